// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

namespace organbake {

// Both refuse early, before hours of work, what could not be written in the end. Throw IoError
// (writing), and UsageError for a name with another ending than ".ply", say: the format is fixed.
void check_output_file(const std::filesystem::path& file, const std::filesystem::path& ending);
// A folder that exists is replaced only when it is empty or holds nothing but what a manifest.json
// or report.json of ours lists: nobody loses a file to a mistyped -o.
void check_output_folder(const std::filesystem::path& folder);

// Makes the folders above a file. Throws IoError (writing).
void make_folder_of(const std::filesystem::path& file);

// Copies one file, making the folders above it. Never a hard link: a user may change a bundle's
// file, and the cache must not change with it. Throws IoError (writing).
void copy_into(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace organbake
