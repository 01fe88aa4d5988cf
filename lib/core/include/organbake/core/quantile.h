// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace organbake {

// The value that `share` (0…1) of the others are at most as large as, the lower of two: 0 gives the
// least and 1 the largest; 0 of none. The median of two middle ones is the upper (below).
template <class T>
T quantile(std::vector<T> values, double share) {
  if (values.empty()) return T{};
  const auto place = share * static_cast<double>(values.size() - 1);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// Times the median of absolute deviations: the standard deviation, where values are normal.
inline constexpr double kSigmaOfMedianDeviation = 1.4826;

// The upper one of an even number; 0 of none.
template <class T>
T median(std::vector<T> values) {
  if (values.empty()) return T{};
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace organbake
