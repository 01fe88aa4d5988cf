// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "picture/sum_stretch.h"

namespace organbake {

// A stretch of one layer's row, decoded from its keys.
struct LayerStretch {
  alignas(64) float depth[kStretch], u[kStretch], v[kStretch];
  alignas(64) std::int32_t slot[kStretch];
};
using LayerStretches = std::array<LayerStretch, 3>;

// The cameras' shares in the view, by layer.
struct LayerShares {
  std::array<float, 3> of;
  int count;  // layers in use
};

// The nearest sample of each pixel: its layer, and its depth, +inf where there is none.
struct NearestSamples {
  alignas(64) std::int32_t layer[kStretch];
  alignas(64) float depth[kStretch];

  NearestSamples(const LayerStretches& rows, int layers, int count);
};

// The sample that speaks for each pixel: of the camera with the largest share of those that see the
// nearest skin (up to tolerance_mm behind it). The nearest sample itself may be of a camera that
// hardly counts there.
struct DominantSamples {
  alignas(64) std::int32_t layer[kStretch];

  DominantSamples(const LayerShares& shares, const LayerStretches& rows, const SumStretch& sum,
                  float tolerance_mm, int count);
};

}  // namespace organbake
