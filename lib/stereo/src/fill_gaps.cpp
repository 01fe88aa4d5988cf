// SPDX-License-Identifier: GPL-3.0-or-later
#include "refine_disparity.h"

#include <algorithm>
#include <cmath>

#include "organbake/stereo/local_planes.h"

namespace organbake {
namespace {

constexpr float kLeastSd_px = 0.03F;  // what is finer is not noise but the model
constexpr int kSmooth_px = 4;         // radius
constexpr float kSmoothTo_px = 0.6F;  // a surface that leaves its plane by more is not smoothed

Plane certainty(const Plane& sd_px, const Mask& known) {
  Plane weight(known.width, known.height);
  for (std::size_t k = 0; k < weight.size(); ++k) {
    const float sd = std::max(kLeastSd_px, sd_px.values[k]);
    weight.values[k] = known.values[k] ? kLeastSd_px * kLeastSd_px / (sd * sd) : 0;
  }
  return weight;
}

void smooth(const Plane& weight, Disparity& disparity) {
  const LocalPlanes planes(disparity.px, weight, kSmooth_px);
  for (int y = 0; y < disparity.px.height; ++y)
    for (int x = 0; x < disparity.px.width; ++x) {
      if (!disparity.known.at(x, y)) continue;
      const LocalPlanes::Fit fit = planes.at(x, y);
      const float keep = fit.variance / (fit.variance + kSmoothTo_px * kSmoothTo_px);
      float& px = disparity.px.at(x, y);
      px = fit.value + keep * (px - fit.value);
    }
}

}  // namespace

void drop_strangers(Disparity& disparity) {
  constexpr int kRounds = 2;  // strangers bend the planes that they are told by
  constexpr float kFar_px = 1.0F, kFarShare = 0.03F, kSurrounded = 0.3F;
  const int width = disparity.px.width, height = disparity.px.height;
  const int radius = std::max(4, width / 80);
  for (int round = 0; round < kRounds; ++round) {
    Plane known(width, height);
    for (std::size_t k = 0; k < known.size(); ++k) known.values[k] = disparity.known.values[k];
    const LocalPlanes around(disparity.px, known, radius);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        if (!disparity.known.at(x, y)) continue;
        const float px = disparity.px.at(x, y), off = std::abs(px - around.at(x, y).value);
        if (around.weight(x, y) < kSurrounded || off > kFar_px + kFarShare * std::abs(px))
          disparity.known.at(x, y) = 0;
      }
  }
}

Mask smooth_and_fill(const Plane& sd_px, const Mask& tissue, double reach, Disparity& disparity) {
  const int width = tissue.width, height = tissue.height;
  smooth(certainty(sd_px, disparity.known), disparity);
  Mask filled(width, height);
  const int radius = static_cast<int>(std::lround(reach * width));
  if (radius < 1) return filled;
  constexpr float kMostSides = 0.45F, kFlat = 0.02F;  // of the window; of the disparity
  Plane known(width, height);
  for (std::size_t k = 0; k < known.size(); ++k) known.values[k] = disparity.known.values[k];
  const LocalPlanes around(disparity.px, known, radius);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (!tissue.at(x, y) || disparity.known.at(x, y) || around.weight(x, y) <= 0) continue;
      const LocalPlanes::Fit fit = around.at(x, y);
      disparity.px.at(x, y) = fit.value;
      const float most = kFlat * fit.value;
      filled.at(x, y) = around.weight(x, y) >= kMostSides && fit.variance <= most * most;
    }
  return filled;
}

}  // namespace organbake
