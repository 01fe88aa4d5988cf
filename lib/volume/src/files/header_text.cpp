// SPDX-License-Identifier: GPL-3.0-or-later
#include "files/header_text.h"

#include <algorithm>
#include <charconv>

#include "organbake/core/error.h"

namespace organbake {
namespace {

constexpr std::size_t kPiece = std::size_t{1} << 12;
constexpr std::size_t kLongestHeader = std::size_t{1} << 20;
constexpr std::string_view kSeparators = " \t\r\n,()";

template <typename Number>
std::vector<Number> parse(const std::string& text, const std::string& field) {
  std::vector<Number> values;
  std::size_t at = 0;
  while ((at = text.find_first_not_of(kSeparators, at)) != std::string::npos) {
    const std::size_t end = std::min(text.find_first_of(kSeparators, at), text.size());
    const char* first = text.data() + at + (text[at] == '+' ? 1 : 0);
    Number value{};
    const auto [stop, error] = std::from_chars(first, text.data() + end, value);
    if (error != std::errc() || stop != text.data() + end) {
      throw BadDataError(field + " \"" + text.substr(0, 80) + "\" is not a list of numbers");
    }
    values.push_back(value);
    at = end;
  }
  return values;
}

}  // namespace

HeaderText::HeaderText(const std::filesystem::path& file) : file_(file), stream_(file) {}

bool HeaderText::read_more() {
  const std::size_t before = text_.size();
  text_.resize(std::min(before + kPiece, kLongestHeader));
  const auto room = std::as_writable_bytes(std::span(text_)).subspan(before);
  text_.resize(before + stream_.read(room));
  return text_.size() > before;
}

bool HeaderText::next_line(std::string& line) {
  std::size_t end = text_.find('\n', offset_);
  for (std::size_t looked = text_.size(); end == std::string::npos && read_more();) {
    end = text_.find('\n', looked);
    looked = text_.size();
  }
  if (offset_ >= text_.size()) return false;
  if (end == std::string::npos && text_.size() == kLongestHeader) {
    throw BadDataError(file_, "has no end of its header in the first megabyte");
  }
  line = text_.substr(offset_, end == std::string::npos ? end : end - offset_);
  if (!line.empty() && line.back() == '\r') line.pop_back();
  offset_ = end == std::string::npos ? text_.size() : end + 1;
  return true;
}

std::string lower_case(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + ('a' - 'A'));
  }
  return result;
}

std::vector<double> numbers(const std::string& text, const std::string& field) {
  return parse<double>(text, field);
}

std::vector<std::int64_t> integers(const std::string& text, const std::string& field) {
  return parse<std::int64_t>(text, field);
}

}  // namespace organbake
