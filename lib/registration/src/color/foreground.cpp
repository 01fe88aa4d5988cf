// SPDX-License-Identifier: GPL-3.0-or-later
#include "pose/pose_candidates.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "organbake/core/median.h"

namespace organbake {
namespace {

std::vector<float> border_values(const PhotoLevel& level) {
  std::vector<float> values;
  const int w = level.intrinsics.width, h = level.intrinsics.height;
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const bool border = x == 0 || y == 0 || x == w - 1 || y == h - 1;
      if (border && level.valid[level.index(x, y)])
        values.push_back(level.luminance[level.index(x, y)]);
    }
  return values;
}

}  // namespace

std::optional<Foreground> find_foreground(const PhotoLevel& level) {
  constexpr float kMadToSigma = 1.4826f, kOutstanding = 6, kLeast = 0.015f;
  constexpr float kPlain = 0.05f;  // spread of a plain border, of the luminance range
  constexpr double kFewest = 0.01, kMost = 0.85;  // of the picture
  std::vector<float> border = border_values(level);
  if (border.size() < 16) return std::nullopt;
  const float background = median(border);
  for (float& value : border) value = std::abs(value - background);
  const float spread = kMadToSigma * median(border);
  if (spread > kPlain) return std::nullopt;
  const float threshold = std::max(kLeast, kOutstanding * spread);
  Foreground found;
  for (int y = 0; y < level.intrinsics.height; ++y)
    for (int x = 0; x < level.intrinsics.width; ++x) {
      // A blown pixel inside the organ is part of it all the same.
      const std::size_t i = level.index(x, y);
      if (level.valid[i] && std::abs(level.luminance[i] - background) < threshold) continue;
      found.area_px += 1;
      found.center_px += Eigen::Vector2d(x + 0.5, y + 0.5);
    }
  const double share = found.area_px / static_cast<double>(level.luminance.size());
  if (share < kFewest || share > kMost) return std::nullopt;
  found.center_px /= found.area_px;
  return found;
}

}  // namespace organbake
