// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/grid_filters.h"

#include <algorithm>
#include <cmath>

namespace organbake {
namespace {

// A length, in normalised coordinates, over which curvature keeps its sign. Measured on the near
// surfaces of organbench: from 0.03 to 0.06 errors under 1 % of noise change by a twentieth; under
// 3 % the steepest surface gains a fifth by the larger, the flattest loses a twentieth.
constexpr double kCurvatureLength = 0.04;
// Less would smooth away folds that are few but sharp (the phantom's laparoscopy: 0.6 % for 0.3 %).
constexpr double kLeast = 0.25, kMost = 1;

}  // namespace

double roughness_of(const Plane& v, const ShadedImage& image) {
  const double per_xx = 1 / (image.rays.step_x * image.rays.step_x);
  const double per_yy = 1 / (image.rays.step_y * image.rays.step_y);
  const double per_xy = 0.25 / (image.rays.step_x * image.rays.step_y);
  double sum = 0, count = 0;
  // Not at the border, where the penalty alone holds the surface.
  for (int y = 2; y + 2 < v.height; ++y)
    for (int x = 2; x + 2 < v.width; ++x) {
      if (!image.inside.at(x, y)) continue;
      const double xx = per_xx * (v.at(x - 1, y) - 2 * v.at(x, y) + v.at(x + 1, y));
      const double yy = per_yy * (v.at(x, y - 1) - 2 * v.at(x, y) + v.at(x, y + 1));
      const double xy = per_xy * (v.at(x + 1, y + 1) - v.at(x - 1, y + 1) - v.at(x + 1, y - 1) +
                                  v.at(x - 1, y - 1));
      sum += xx * xx + 2 * xy * xy + yy * yy;
      ++count;
    }
  const double curvature = std::sqrt(sum / std::max(1.0, count));
  // Written so that NaN gives the least.
  return curvature > 0 ? std::clamp(kCurvatureLength * curvature, kLeast, kMost) : kLeast;
}

}  // namespace organbake
