// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/slice_resampling.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "volume/grid.h"

namespace organbake {
namespace {

// Bilinear sample of slice k at a continuous (column, row); `air` beyond its pixels.
double sample(const Volume& stack, int k, double x, double y, double air) {
  const double left = std::floor(x), top = std::floor(y);
  const double fx = x - left, fy = y - top;
  const auto pixel = [&](double column, double row) -> double {
    if (column < 0 || row < 0 || column >= stack.size[0] || row >= stack.size[1]) return air;
    return stack.at(static_cast<int>(column), static_cast<int>(row), k);
  };
  // A whole-pixel position takes its one pixel, so that the last column is not mixed with air.
  const double right = fx > 0 ? left + 1 : left, bottom = fy > 0 ? top + 1 : top;
  const double upper = (1 - fx) * pixel(left, top) + fx * pixel(right, top);
  const double lower = (1 - fx) * pixel(left, bottom) + fx * pixel(right, bottom);
  return (1 - fy) * upper + fy * lower;
}

// The slice below a place along the normal, and how far it lies towards the next.
struct Between {
  int below = 0;
  double share = 0;
};

Between find_between(const std::vector<double>& along_mm, double at_mm) {
  const auto above = std::upper_bound(along_mm.begin(), along_mm.end(), at_mm);
  const auto last = static_cast<std::ptrdiff_t>(along_mm.size()) - 2;
  const auto below = std::clamp<std::ptrdiff_t>(above - along_mm.begin() - 1, 0, last);
  const double gap = along_mm[below + 1] - along_mm[below];
  return {static_cast<int>(below), std::clamp((at_mm - along_mm[below]) / gap, 0.0, 1.0)};
}

}  // namespace

Volume resample_stack(const DicomStack& stack, const Volume& decoded) {
  Eigen::Vector2d least = Eigen::Vector2d::Zero(), most = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& drift : stack.drift_px) {
    least = least.cwiseMin(drift);
    most = most.cwiseMax(drift);
  }
  const Eigen::Vector2d first = least.array().floor();  // index of the grid's first column and row
  Volume out;
  out.spacing_mm = decoded.spacing_mm;
  out.spacing_mm[2] = stack.spacing_mm;
  out.direction = decoded.direction;
  out.origin_mm = decoded.world_from_index({first.x(), first.y(), 0});
  out.warnings = decoded.warnings;
  constexpr double kRoundingSlack = 1e-6;  // the last slice must not be lost to a last digit
  const auto slices = static_cast<std::int64_t>(
                          std::floor(stack.along_mm.back() / stack.spacing_mm + kRoundingSlack)) +
                      1;
  const std::array<std::int64_t, 3> size = {
      decoded.size[0] + static_cast<std::int64_t>(std::ceil(most.x()) - first.x()),
      decoded.size[1] + static_cast<std::int64_t>(std::ceil(most.y()) - first.y()), slices};
  out.voxels.resize(checked_voxel_count(size, stack.slices.front().file.string()));
  for (int axis = 0; axis < 3; ++axis) out.size[axis] = static_cast<int>(size[axis]);
  const double air = value_range(decoded).min;

  tbb::parallel_for(0, out.size[2], [&](int k) {
    const Between at = find_between(stack.along_mm, k * stack.spacing_mm);
    const Eigen::Vector2d below = first - stack.drift_px[at.below];
    const Eigen::Vector2d above = first - stack.drift_px[at.below + 1];
    std::int16_t* voxel = out.voxels.data() + std::size_t(k) * out.size[0] * out.size[1];
    for (int j = 0; j < out.size[1]; ++j) {
      for (int i = 0; i < out.size[0]; ++i, ++voxel) {
        const double a = sample(decoded, at.below, i + below.x(), j + below.y(), air);
        const double b = sample(decoded, at.below + 1, i + above.x(), j + above.y(), air);
        *voxel = static_cast<std::int16_t>(std::lround((1 - at.share) * a + at.share * b));
      }
    }
  });
  return out;
}

}  // namespace organbake
