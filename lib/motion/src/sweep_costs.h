// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/shading/grid.h"

namespace organbake {

// A frame on one level of a pyramid, as it is matched (shading/grid_filters.h).
struct SweepView {
  PosedCamera camera;
  Plane pattern;
  Mask counts;
};

// The depths that are tried: at each pixel inverse depths base + k · step, k = 0 … count − 1. A
// base that follows the surface makes windows that lie on it, however slanted.
struct InverseDepthLabels {
  Plane base;
  float step = 0;
  int count = 0;
};

// What each label of each pixel costs, 0 (all alike) … kWorst, the labels of a pixel side by side.
struct CostVolume {
  static constexpr std::uint8_t kWorst = 250;
  int width = 0, height = 0;
  int labels = 0;
  std::vector<std::uint8_t> costs;

  const std::uint8_t* at(int x, int y) const {
    return &costs[(std::size_t(y) * width + x) * std::size_t(labels)];
  }
};

inline constexpr int kWindowRadius_px = 5;  // of the correlation

// 1 − NCC of the patterns (Lewis 1995), what does not count left out, as the mean of the best
// neighbours: those that see the pixel's surroundings unhidden. Where no neighbour sees enough of a
// window all labels cost the same.
CostVolume neighbour_costs(const SweepView& reference, const std::vector<SweepView>& neighbours,
                           const InverseDepthLabels& labels);

// Sums of the costs with what neighbours ask for, along eight directions (semi-global matching,
// Hirschmüller 2008). Labels of a pixel side by side, as in the volume.
std::vector<std::uint16_t> aggregated(const CostVolume& volume, const Plane& grey);

}  // namespace organbake
