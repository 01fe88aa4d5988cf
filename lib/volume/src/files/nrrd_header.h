// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "files/byte_stream.h"
#include "files/voxel_decoding.h"

namespace organbake {

// The fields of a NRRD header, and what they mean for reading the voxels. All members throw
// BadDataError naming the file and the field.
class NrrdHeader {
 public:
  explicit NrrdHeader(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  bool has(const std::string& field) const { return fields_.count(field) > 0; }
  // The field's text, lower-case names; empty when it is missing.
  std::string get(const std::string& field) const;
  std::int64_t integer(const std::string& field, std::int64_t otherwise) const;
  // A note ("key:=value"), to which the standard gives no meaning, but some programs do; empty when
  // it is missing. Its key keeps its case.
  std::string note(const std::string& key) const;

  VoxelEncoding encoding() const;
  bool is_text() const;
  // Opens the data, wherever it is, at its first voxel; `bytes` = what the voxels take.
  ByteStream open_data(std::uint64_t bytes) const;
  [[noreturn]] void fail(const std::string& message) const;

 private:
  ByteStream::Coding coding() const;
  // Files that the voxels are spread over; none when they lie in one.
  std::vector<std::filesystem::path> data_files(const std::string& name) const;

  std::filesystem::path path_;
  std::map<std::string, std::string> fields_, notes_;
  std::uint64_t data_offset_ = 0;
};

}  // namespace organbake
