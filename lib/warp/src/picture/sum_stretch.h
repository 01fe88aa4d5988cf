// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "organbake/warp/frame.h"
#include "organbake/warp/vector_loops.h"

namespace organbake {

// Pixels at a time. A stretch's planes and what it reads then stay in the first-level cache, which
// those of a tile's whole row don't.
inline constexpr int kStretch = 128;
static_assert(kStretch % kLanes == 0);
inline constexpr float kFullScale = 255.0f * 255.0f;  // square-root light squared

// A stretch of a tile's row while it is summed: colour × weight in 0…255², the weight, and the
// depth of the nearest skin (mm).
struct SumStretch {
  alignas(64) float red[kStretch], green[kStretch], blue[kStretch], weight[kStretch];
  alignas(64) float nearest[kStretch];
};

// Sums to sRGB bytes; background where nothing weighs.
void encode(const SumStretch& sum, int count, const std::array<std::uint8_t, 3>& background,
            std::uint8_t* __restrict rgb, Cover* __restrict cover);

}  // namespace organbake
