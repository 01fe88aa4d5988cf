// SPDX-License-Identifier: Apache-2.0
#include "organbake/options/meant_number.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/text.h"

namespace organbake {
namespace {

std::optional<double> as_number(const std::string& text) {
  double value = 0;
  if (text.empty() || read_number(text, value) != text.size()) return std::nullopt;
  return value;
}

}  // namespace

bool NumberRange::holds(double value) const {
  return std::isfinite(value) && (!min || value >= *min) && (!max || value <= *max);
}

std::string meant_number(const NumberRange& range, std::string text) {
  if (std::count(text.begin(), text.end(), ',') != 1) return {};
  std::replace(text.begin(), text.end(), ',', '.');
  const auto value = as_number(text);
  return value && range.holds(*value) ? "; decimals stand behind a point: " + to_text(*value)
                                      : std::string();
}

}  // namespace organbake
