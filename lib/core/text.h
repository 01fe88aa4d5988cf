// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

namespace organbake {

// The shortest decimal text that reads back as the same double; never depends on the locale.
std::string to_text(double value);
// With a fixed number of digits after the point, for messages: 12.345 → "12.35".
std::string to_text(double value, int digits_after_point);
// With zeros in front up to that many digits, so that names sort as numbers: (7, 3) → "007".
std::string padded(std::size_t number, std::size_t digits);

// For text and for quoted attributes of an HTML page or an SVG.
std::string escape_html(const std::string& text);

}  // namespace organbake
