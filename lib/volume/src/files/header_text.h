// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "files/byte_stream.h"
#include "organbake/core/text.h"

namespace organbake {

// The text part of a MetaImage or NRRD file, taken apart without regard to the locale. All throw
// BadDataError naming the file and the field.
class HeaderText {
 public:
  explicit HeaderText(const std::filesystem::path& file);

  // The next line without its end; false at the end of the header's 1 MB limit or of the file. Of
  // the file little more is read than the lines asked for: voxels may follow them.
  bool next_line(std::string& line);
  // Offset in the file of what follows the last line read.
  std::uint64_t offset() const { return offset_; }

 private:
  bool read_more();

  std::filesystem::path file_;
  ByteStream stream_;
  std::string text_;  // what was read so far
  std::uint64_t offset_ = 0;
};

std::string lower_case(std::string_view text);
// Numbers separated by spaces; brackets and commas count as spaces.
std::vector<double> numbers(const std::string& text, const std::string& field);
std::vector<std::int64_t> integers(const std::string& text, const std::string& field);

}  // namespace organbake
