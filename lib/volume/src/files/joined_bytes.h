// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "files/byte_stream.h"

namespace organbake {

// A part of the voxels that lies in a file of its own.
struct VoxelPart {
  std::filesystem::path file;
  std::uint64_t offset = 0;  // of its first byte
};

// The files of a volume that is spread over several, slice by slice or block by block.
// `pattern` = a C format of one number ("slice%03d.raw") and its first, last and step ("1 50 1").
// Throws BadDataError naming `header` when that is no such thing or asks for too many files.
std::vector<std::filesystem::path> files_of_pattern(const std::string& pattern,
                                                    const std::filesystem::path& header);

// The parts one after another, `bytes_each` of each once it is decompressed. Reading throws
// BadDataError naming the part that is too short.
ByteStream joined_parts(std::vector<VoxelPart> parts, ByteStream::Coding coding,
                        std::uint64_t bytes_each);

// Of tuples of `values` numbers of `value_bytes` each, every tuple's number `which` alone.
ByteStream every_nth_value(ByteStream tuples, std::size_t value_bytes, std::size_t values,
                           std::size_t which);

}  // namespace organbake
