// SPDX-License-Identifier: Apache-2.0
// Numbers as text and back, without a look at the locale, which may write a comma for the point;
// and small work on texts: padding, trimming, escaping for HTML.
#include "organbake/core/text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <type_traits>

namespace organbake {
namespace {

constexpr std::size_t kLongest = 400;  // of any double in either form we ask for

}  // namespace

#ifdef __cpp_lib_to_chars  // locale-free

namespace {

template <typename... Format>
std::string written(double value, Format... format) {
  std::array<char, kLongest> buffer;
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, format...);
  return {buffer.data(), result.ptr};
}

}  // namespace

std::string to_text(double value) { return written(value); }
std::string to_text(double value, int digits_after_point) {
  return written(value, std::chars_format::fixed, digits_after_point);
}
std::size_t read_number(std::string_view text, double& value) {
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  return result.ec == std::errc() ? static_cast<std::size_t>(result.ptr - text.data()) : 0;
}

#else  // a standard library that has not got so far, on a system without locales

std::string to_text(double value) {
  std::array<char, kLongest> buffer{};
  constexpr int kEnough = 17;  // digits that tell any two doubles apart
  for (int digits = 1; digits <= kEnough; ++digits) {
    std::snprintf(buffer.data(), buffer.size(), "%.*g", digits, value);
    if (std::strtod(buffer.data(), nullptr) == value) break;
  }
  return buffer.data();
}
std::string to_text(double value, int digits_after_point) {
  std::array<char, kLongest> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.*f", digits_after_point, value);
  return buffer.data();
}
std::size_t read_number(std::string_view text, double& value) {
  const std::string copy(text.substr(0, kLongest));  // ends with a zero
  char* end = nullptr;
  value = std::strtod(copy.c_str(), &end);
  return static_cast<std::size_t>(end - copy.c_str());
}

#endif

template <class Number>
std::optional<Number> number_in(std::string_view word) {
  Number value{};
  std::size_t length = 0;
  if constexpr (std::is_floating_point_v<Number>) {
    length = read_number(word, value);
  } else {
    const auto result = std::from_chars(word.data(), word.data() + word.size(), value);
    if (result.ec == std::errc()) length = static_cast<std::size_t>(result.ptr - word.data());
  }
  return length > 0 && length == word.size() ? std::optional(value) : std::nullopt;
}
template std::optional<int> number_in(std::string_view);
template std::optional<long> number_in(std::string_view);
template std::optional<long long> number_in(std::string_view);
template std::optional<std::size_t> number_in(std::string_view);
template std::optional<double> number_in(std::string_view);

std::string percent(double share, int digits_after_point) {
  return to_text(100 * share, digits_after_point) + " %";
}
std::string padded(std::size_t number, std::size_t digits) {
  const std::string text = std::to_string(number);
  return std::string(digits - std::min(digits, text.size()), '0') + text;
}

std::string escape_html(const std::string& text) {
  constexpr std::string_view kLetters = "&<>'\"";
  constexpr std::array<const char*, 5> kEntities = {"&amp;", "&lt;", "&gt;", "&#39;", "&quot;"};
  std::string result;
  for (const char c : text) {
    const std::size_t at = kLetters.find(c);
    at == kLetters.npos ? result += c : result += kEntities[at];
  }
  return result;
}

std::string trimmed(std::string_view text, std::string_view blanks) {
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == text.npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(blanks) + 1 - first));
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + ('a' - 'A'));
  return lower;
}

char first_letter(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first == text.npos ? '\0' : text[first];
}

}  // namespace organbake
