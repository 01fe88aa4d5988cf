// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "picture/sum_span.h"

namespace organbake {

// A span of one layer's row, decoded from its keys.
struct LayerSpan {
  alignas(64) float depth[kSpan], u[kSpan], v[kSpan];
  alignas(64) std::int32_t slot[kSpan];
};
using LayerSpans = std::array<LayerSpan, 3>;

// The cameras' shares in the view, by layer.
struct LayerShares {
  std::array<float, 3> of;
  int count;  // layers in use
};

// The nearest sample of each pixel: its layer, and its depth, +inf where there is none.
struct NearestSamples {
  alignas(64) std::int32_t layer[kSpan];
  alignas(64) float depth[kSpan];

  NearestSamples(const LayerSpans& rows, int layers, int count);
};

// The sample that speaks for each pixel: of the camera with the largest share of those that see the
// nearest skin (up to tolerance_mm behind it). The nearest sample itself may be of a camera that
// hardly counts there.
struct DominantSamples {
  alignas(64) std::int32_t layer[kSpan];

  DominantSamples(const LayerShares& shares, const LayerSpans& rows, const SumSpan& sum,
                  float tolerance_mm, int count);
};

}  // namespace organbake
