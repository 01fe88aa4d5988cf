// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
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
// With zeros in front up to that many digits, so that names sort as numbers: (7, 3) → "007".
std::string padded(std::size_t number, std::size_t digits);

// Without the blanks at both of its ends.
std::string trimmed(std::string_view text, std::string_view blanks = " \t\r\n\v\f");
// The first character that is no blank; 0: there is none.
char first_letter(std::string_view text);

// For text and for quoted attributes of an HTML page or an SVG.
std::string escape_html(const std::string& text);

// "; did you mean 'faces'?" when one of the candidates is close to `name`, whatever their case,
// else nothing. To be put at the end of an error message.
std::string suggestion(std::string_view name, const std::vector<std::string>& candidates);

}  // namespace organbake
