// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

namespace organbake {

// Lines and words of a text mesh file, whatever its line ends; a byte-order mark is skipped.
class TextScanner {
 public:
  // `name` is put before each error. The text must outlive the scanner.
  TextScanner(std::string_view text, std::string name);

  // Goes to the next line with words, without what follows `comment`; false at the end.
  bool next_line(char comment = '#');
  const std::vector<std::string_view>& words() const { return words_; }
  // The number that word `at` of the line is. Throws BadDataError with the line's number.
  double number(std::size_t at) const;
  Eigen::Vector3d vector(std::size_t at) const;  // of three words
  [[noreturn]] void fail(const std::string& message) const;

 private:
  std::string_view rest_;
  std::string name_;
  std::size_t line_ = 0;
  std::vector<std::string_view> words_;
};

}  // namespace organbake
