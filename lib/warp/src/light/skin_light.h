// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "picture/sum_span.h"

namespace organbake {

// Pixels of a span whose light is worked out, and the place on the proxy whose skin each shows.
struct SkinPixels {
  int count = 0;
  alignas(32) std::int32_t at[kSpan];  // of the span
  alignas(32) std::uint32_t face[kSpan];
  alignas(32) float b1[kSpan], b2[kSpan];

  void add(int pixel, std::uint32_t on_face, float at_b1, float at_b2) {
    at[count] = pixel;
    face[count] = on_face;
    b1[count] = at_b1, b2[count] = at_b2;
    ++count;
  }
};

// The colours of a span: `count` pixels of the picture's row y from column x0 on. Gloss is added
// in parts of `white`. All planes have room for whole vectors (wide.h).
struct SpanColors {
  int x0 = 0, y = 0, count = 0;
  std::array<float*, 3> planes;
  const float* white = nullptr;
  const float* depth_mm = nullptr;  // planar z of what is seen, +inf where there is none
};

// One plane for each of a pixel's numbers.
template <int numbers>
struct SkinPlanes {
  alignas(64) float of[numbers][kSpan];

  std::array<float*, numbers> planes() {
    std::array<float*, numbers> all;
    for (int c = 0; c < numbers; ++c) all[c] = of[c];
    return all;
  }
};
using SkinDirections = SkinPlanes<3>;  // x, y, z

}  // namespace organbake
