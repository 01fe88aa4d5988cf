// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

namespace organbake {

// Which numbers an option takes.
struct NumberRange {
  std::string unit = {};  // "rad", "mm" …; empty = none
  std::optional<double> min = {}, max = {};

  bool holds(double value) const;  // false for NaN and infinity
};

// What somebody may have meant whose number was refused, because other programs or other languages
// write it so: degrees where radians are asked for ("; 70 degrees are 1.2217 rad"), or a comma
// before the decimals ("; decimals stand behind a point: 0.5"). Empty when neither would do. To be
// put at the end of an error message.
std::string meant_number(const NumberRange& range, std::string text);

}  // namespace organbake
