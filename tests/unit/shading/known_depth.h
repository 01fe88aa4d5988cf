// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/phantom/known_answers.h"
#include "organbake/shading/grid.h"
#include "support/testing.h"

namespace organbake {

inline double mean_of(const Plane& plane) {
  double sum = 0;
  for (float value : plane.values) sum += value;
  return sum / static_cast<double>(plane.size());
}

// Mean relative error of e^v in percent, one scale fitted (the mean of ln r).
inline double relative_error_percent(const Plane& log_range, const Plane& truth) {
  const double shift = mean_of(truth) - mean_of(log_range);
  double sum = 0;
  for (std::size_t k = 0; k < truth.size(); ++k)
    sum += std::abs(std::exp(log_range.values[k] + shift - truth.values[k]) - 1);
  return 100 * sum / static_cast<double>(truth.size());
}

// Mean |Z error| in pixels, the mean removed.
inline double depth_error_px(const Plane& depth, const Plane& truth) {
  const double shift = mean_of(truth) - mean_of(depth);
  double sum = 0;
  for (std::size_t k = 0; k < truth.size(); ++k)
    sum += std::abs(depth.values[k] + shift - truth.values[k]);
  return sum / static_cast<double>(truth.size());
}

inline bool all_finite(const Plane& plane) {
  return std::all_of(plane.values.begin(), plane.values.end(),
                     [](float value) { return std::isfinite(value); });
}

inline Plane transposed(const Plane& plane) {
  Plane other(plane.height, plane.width);
  for (int y = 0; y < plane.height; ++y)
    for (int x = 0; x < plane.width; ++x) other.at(y, x) = plane.at(x, y);
  return other;
}
inline Plane mirrored(const Plane& plane) {
  Plane other = plane;
  for (int y = 0; y < plane.height; ++y)
    for (int x = 0; x < plane.width; ++x) other.at(plane.width - 1 - x, y) = plane.at(x, y);
  return other;
}
inline double largest_difference(const Plane& a, const Plane& b) {
  double largest = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    largest = std::max(largest, std::abs(double(a.values[k]) - b.values[k]));
  return largest;
}

}  // namespace organbake
