// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

namespace organbake {

// Which numbers an option takes.
struct NumberRange {
  std::optional<double> min = {}, max = {};

  bool holds(double value) const;  // false for NaN and infinity
};

// What somebody may have meant whose number was refused, because other languages write it so: a
// comma before the decimals ("; decimals stand behind a point: 0.5"). Empty when that would not do.
// To be put at the end of an error message.
std::string meant_number(const NumberRange& range, std::string text);

}  // namespace organbake
