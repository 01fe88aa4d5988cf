// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace organbake {

// The shortest decimal text that reads back as the same double; never depends on the locale.
std::string to_text(double value);
// With a fixed number of digits after the point, for messages: 12.345 → "12.35".
std::string to_text(double value, int digits_after_point);
// A share of 1 in percent, likewise: 0.1234 → "12 %".
std::string percent(double share, int digits_after_point = 0);
// The decimal number that `text` begins with, in the C locale, and how long it is; 0: there is
// none.
[[nodiscard]] std::size_t read_number(std::string_view text, double& value);
// The number that a whole word is, in the C locale: an int, a long, a long long, a std::size_t or a
// double. Nothing for any other word.
template <class Number>
[[nodiscard]] std::optional<Number> number_in(std::string_view word);
// With zeros in front up to that many digits, so that names sort as numbers: (7, 3) → "007".
std::string padded(std::size_t number, std::size_t digits);

// Without the blanks at both of its ends.
std::string trimmed(std::string_view text, std::string_view blanks = " \t\r\n\v\f");
// In small letters, those of ASCII alone.
std::string lower_case(std::string_view text);
// The first character that is no blank; 0: there is none.
char first_letter(std::string_view text);

// The items of a list, or their texts, with something between them.
template <class Items, class TextOf = std::identity>
std::string joined(const Items& items, std::string_view between, const TextOf& text_of = {}) {
  std::string text;
  bool first = true;
  for (const auto& item : items) {
    if (!first) text += between;
    first = false;
    text += text_of(item);
  }
  return text;
}

// For text and for quoted attributes of an HTML page or an SVG.
std::string escape_html(const std::string& text);

// "; did you mean 'faces'?" when one of the candidates is close to `name`, whatever their case,
// else nothing. To be put at the end of an error message.
std::string suggestion(std::string_view name, const std::vector<std::string>& candidates);

// Bytes as base64 (RFC 4648), on one line, filled up to whole groups of four letters.
std::string to_base64(std::span<const std::byte> bytes);
// Takes four letters of base64 (white space is passed over) off the text and adds the one to three
// bytes that they stand for. False, with nothing added, where there are no four.
[[nodiscard]] bool take_base64_group(std::string_view& text, std::string& bytes);

}  // namespace organbake
