// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "organbake/warp/frame.h"
#include "picture/vector_loops.h"

namespace organbake {

// Pixels at a time. A span's planes and what it reads then stay in the first-level cache, which
// those of a tile's whole row don't.
inline constexpr int kSpan = 128;
static_assert(kSpan % kLanes == 0);
inline constexpr float kFullScale = 255.0f * 255.0f;  // square-root light squared

// A span of a tile's row while it is summed: colour × weight in 0…255², the weight, and the
// depth of the nearest skin (mm).
struct SumSpan {
  alignas(64) float red[kSpan], green[kSpan], blue[kSpan], weight[kSpan];
  alignas(64) float nearest[kSpan];
};

// Sums to sRGB bytes; background where nothing weighs.
void encode(const SumSpan& sum, int count, const std::array<std::uint8_t, 3>& background,
            std::uint8_t* __restrict rgb, Cover* __restrict cover);

}  // namespace organbake
