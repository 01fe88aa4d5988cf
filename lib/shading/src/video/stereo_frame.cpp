// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/frame.h"

#include <algorithm>
#include <cmath>

#include "organbake/shading/grid_filters.h"

namespace organbake {
namespace {

constexpr int kHalfSide = 96;  // of a half, at most: enough to know a scene again
// Chosen, not measured: real frames of one eye and of two are still to be held against it.
constexpr double kAlike = 0.7;
constexpr double kMostDisparity = 0.15;  // of the half's size: the largest disparity
constexpr int kRowsAskew = 2;            // eyes may stand a little askew

Plane reduced_half(const Rgb8Image& frame, int left, int top, int width, int height) {
  const int step = std::max(1, (std::max(width, height) + kHalfSide - 1) / kHalfSide);
  Plane half(width / step, height / step);
  for (int y = 0; y < half.height; ++y)
    for (int x = 0; x < half.width; ++x) {
      int sum = 0;
      for (int j = 0; j < step; ++j)
        for (int i = 0; i < step; ++i) sum += frame.at(left + x * step + i, top + y * step + j)[1];
      half.at(x, y) = static_cast<float>(sum) / static_cast<float>(step * step);
    }
  // Slow shading is alike in many pictures.
  const Mask all(half.width, half.height, 1);
  const Plane slow = box_mean(half, all, std::max(1, std::min(half.width, half.height) / 6));
  for (std::size_t k = 0; k < half.size(); ++k) half.values[k] -= slow.values[k];
  return half;
}

double correlation(const Plane& a, const Plane& b, int shift_x, int shift_y) {
  double aa = 0, bb = 0, ab = 0;
  for (int y = std::max(0, -shift_y); y < a.height - std::max(0, shift_y); ++y)
    for (int x = std::max(0, -shift_x); x < a.width - std::max(0, shift_x); ++x) {
      const double p = a.at(x, y), q = b.at(x + shift_x, y + shift_y);
      aa += p * p;
      bb += q * q;
      ab += p * q;
    }
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0;
}

bool alike(const Plane& a, const Plane& b) {
  const int reach = static_cast<int>(kMostDisparity * a.width);
  double best = 0;
  for (int dy = -kRowsAskew; dy <= kRowsAskew; ++dy)
    for (int dx = -reach; dx <= reach; ++dx) best = std::max(best, correlation(a, b, dx, dy));
  return best >= kAlike;
}

}  // namespace

StereoLayout find_stereo_layout(const Rgb8Image& frame) {
  constexpr int kSmallest = 32;
  const int width = frame.width, height = frame.height;
  if (width < kSmallest || height < kSmallest) return StereoLayout::none;
  if (alike(reduced_half(frame, 0, 0, width / 2, height),
            reduced_half(frame, width - width / 2, 0, width / 2, height)))
    return StereoLayout::side_by_side;
  if (alike(reduced_half(frame, 0, 0, width, height / 2),
            reduced_half(frame, 0, height - height / 2, width, height / 2)))
    return StereoLayout::top_bottom;
  return StereoLayout::none;
}

}  // namespace organbake
