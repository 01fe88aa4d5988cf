// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "organbake/pipelines/stage.h"

namespace organbake {

// XXH3-128 as 32 hexadecimal digits: names content in the cache. It is quick, not proof against an
// attacker; what leaves the cache in a bundle carries SHA-256.
std::string quick_hash(std::string_view text);
// Throws NoInputError or IoError.
std::string quick_hash_of_file(const std::filesystem::path& path);

// A file that belongs to an input, under the name that counts for the content hash.
struct InputFile {
  std::string name;
  std::filesystem::path path;
};

// All files that an input consists of, in byte order of their names: the file itself, all below a
// folder, a header's data file, the photographs of a cameras.json. Throws NoInputError for a path
// that is missing or an empty folder.
std::vector<InputFile> files_of_input(InputKind kind, const std::filesystem::path& path);

// Whether a file begins as DICOM files do. Throws NoInputError or IoError.
bool has_dicom_mark(const std::filesystem::path& path);

// One hash for an input: its only file's, or that of the list of names and hashes.
using FileHasher = std::string (*)(const std::filesystem::path&);
std::string content_hash(const std::vector<InputFile>& files, FileHasher hash_file);
std::string sha256_of_file(const std::filesystem::path& path);

}  // namespace organbake
