// SPDX-License-Identifier: GPL-3.0-or-later
#include "grid/slice_resampling.h"

#include <algorithm>
#include <cmath>

#include "dicom/dicom_pixels.h"
#include "grid/affine_grid.h"
#include "organbake/core/parallel.h"

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

// The upright grid's first column and row, in pixels of the stack's first slice.
Eigen::Vector2d corner_px(const DicomStack& stack) {
  Eigen::Vector2d least = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& drift : stack.drift_px) least = least.cwiseMin(drift);
  return least.array().floor();
}

}  // namespace

Volume upright_grid(const DicomStack& stack, const Volume& first) {
  const Eigen::Vector2d corner = corner_px(stack);
  Eigen::Vector2d most = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& drift : stack.drift_px) most = most.cwiseMax(drift);
  Volume grid;
  grid.spacing_mm = first.spacing_mm;
  grid.spacing_mm[2] = stack.spacing_mm;
  grid.direction = first.direction;
  grid.origin_mm = first.world_from_index({corner.x(), corner.y(), 0});
  constexpr double kRoundingSlack = 1e-6;  // the last slice must not be lost to a last digit
  const auto slices = static_cast<std::int64_t>(
                          std::floor(stack.along_mm.back() / stack.spacing_mm + kRoundingSlack)) +
                      1;
  const std::array<std::int64_t, 3> size = {
      first.size[0] + static_cast<std::int64_t>(std::ceil(most.x()) - corner.x()),
      first.size[1] + static_cast<std::int64_t>(std::ceil(most.y()) - corner.y()), slices};
  checked_voxel_count(size, stack.slices.front().file.parent_path().string());
  for (int axis = 0; axis < 3; ++axis) grid.size[axis] = static_cast<int>(size[axis]);
  return grid;
}

SliceRange slices_needed(const DicomStack& stack, int k, int k_end) {
  return {find_between(stack.along_mm, k * stack.spacing_mm).below,
          find_between(stack.along_mm, (k_end - 1) * stack.spacing_mm).below + 2};
}

void resample_slices(const DicomStack& stack, const Volume& decoded, const SliceRange& range,
                     const IndexBox& box, int k, int count, Volume& out) {
  const Eigen::Vector2d first = corner_px(stack) + Eigen::Vector2d(box.first[0], box.first[1]);
  parallel_for(k, k + count, [&](int slice) {
    const Between at = find_between(stack.along_mm, (box.first[2] + slice) * stack.spacing_mm);
    const Eigen::Vector2d below = first - stack.drift_px[at.below];
    const Eigen::Vector2d above = first - stack.drift_px[at.below + 1];
    std::size_t voxel = std::size_t(slice) * box.size[0] * box.size[1];
    for (int j = 0; j < box.size[1]; ++j) {
      for (int i = 0; i < box.size[0]; ++i, ++voxel) {
        const int k_below = at.below - range.first;
        const double a = sample(decoded, k_below, i + below.x(), j + below.y(), kAir_hu);
        const double b = sample(decoded, k_below + 1, i + above.x(), j + above.y(), kAir_hu);
        set_value(out, voxel, (1 - at.share) * a + at.share * b);
      }
    }
  });
}

}  // namespace organbake
