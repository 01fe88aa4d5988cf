// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace organbake {

// Words and arrays of numbers of a legacy VTK file, one after the other. All members throw
// BadDataError naming the file when it ends too early or holds no number where one must be.
class LegacyVtkScanner {
 public:
  LegacyVtkScanner(std::span<const std::byte> bytes, std::string name);

  bool binary() const { return binary_; }
  // The next word; empty at the end of the file.
  std::string word();
  void skip_line();
  void skip_to_empty_line();
  // A count that the rest of the file can hold when each item takes at least `least_bytes`.
  std::size_t count(std::size_t least_bytes);
  // `count` numbers of a VTK type name ("float", "int", "vtktypeint64" …), big-endian when binary.
  std::vector<double> numbers(const std::string& type, std::size_t count);
  [[noreturn]] void fail(const std::string& message) const;

 private:
  std::string_view rest() const { return text_.substr(at_); }
  std::vector<double> binary_numbers(const std::string& type, std::size_t count);

  std::string_view text_;
  std::string name_;
  std::size_t at_ = 0;
  bool binary_ = false;
};

}  // namespace organbake
