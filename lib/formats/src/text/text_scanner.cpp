// SPDX-License-Identifier: GPL-3.0-or-later
#include "text/text_scanner.h"

#include <algorithm>
#include <charconv>

#include "organbake/core/error.h"

namespace organbake {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr std::string_view kBlank = " \t\f\v";

}  // namespace

TextScanner::TextScanner(std::string_view text, std::string name)
    : rest_(text), name_(std::move(name)) {
  if (rest_.starts_with(kByteOrderMark)) rest_.remove_prefix(kByteOrderMark.size());
}

bool TextScanner::next_line(char comment) {
  words_.clear();
  while (words_.empty()) {
    if (rest_.empty()) return false;
    const std::size_t end = std::min(rest_.find_first_of("\r\n"), rest_.size());
    std::string_view line = rest_.substr(0, end);
    const bool both = end + 1 < rest_.size() && rest_[end] == '\r' && rest_[end + 1] == '\n';
    rest_.remove_prefix(std::min(end + (both ? 2 : 1), rest_.size()));
    ++line_;
    line = line.substr(0, line.find(comment));
    for (;;) {
      const std::size_t begin = line.find_first_not_of(kBlank);
      if (begin == std::string_view::npos) break;
      line.remove_prefix(begin);
      const std::size_t length = std::min(line.find_first_of(kBlank), line.size());
      words_.push_back(line.substr(0, length));
      line.remove_prefix(length);
    }
  }
  return true;
}

double TextScanner::number(std::size_t at) const {
  if (at >= words_.size()) fail("a number is missing");
  std::string_view word = words_[at];
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0;
  const auto result = std::from_chars(word.data(), word.data() + word.size(), value);
  if (result.ec != std::errc() || result.ptr != word.data() + word.size()) {
    fail("\"" + std::string(word.substr(0, 40)) + "\" is not a number");
  }
  return value;
}

Eigen::Vector3d TextScanner::vector(std::size_t at) const {
  return {number(at), number(at + 1), number(at + 2)};
}

void TextScanner::fail(const std::string& message) const {
  throw BadDataError(name_ + ": line " + std::to_string(line_) + ": " + message);
}

}  // namespace organbake
