// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "warp/sum_stretch.h"

namespace organbake {

// Pixels of one row of a tile that are to be lit, and the place on the proxy whose skin each shows.
// Structure of arrays: light is worked out for eight pixels at a time.
struct SkinPixels {
  static constexpr int kMost = kStretch;

  int count = 0;
  alignas(32) std::int32_t column[kMost];  // of the picture
  alignas(32) std::uint32_t face[kMost];
  alignas(32) float b1[kMost], b2[kMost];

  void add(int x, std::uint32_t on_face, float at_b1, float at_b2) {
    column[count] = x;
    face[count] = on_face;
    b1[count] = at_b1, b2[count] = at_b2;
    ++count;
  }
};

// What becomes of each pixel's colour: colour · gain + white · gloss.
struct SkinLight {
  alignas(32) float gain[3][SkinPixels::kMost], gloss[3][SkinPixels::kMost];
};

// One direction for each pixel.
struct SkinDirections {
  alignas(32) float x[SkinPixels::kMost], y[SkinPixels::kMost], z[SkinPixels::kMost];
};

}  // namespace organbake
