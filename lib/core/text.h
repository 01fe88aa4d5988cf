// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace organbake {

// The shortest decimal text that reads back as the same double; never depends on the locale.
std::string to_text(double value);
// With a fixed number of digits after the point, for messages: 12.345 → "12.35".
std::string to_text(double value, int digits_after_point);

}  // namespace organbake
