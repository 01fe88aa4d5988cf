// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "warp/frame.h"
#include "warp/tile_grid.h"

namespace organbake {

inline constexpr int kRow = TileGrid::kWidth;
inline constexpr float kFullScale = 255.0f * 255.0f;  // square-root light squared

// One row of a tile while it is summed: colour × weight in 0…255², the weight, and the depth of the
// nearest skin (mm).
struct SumRow {
  alignas(32) float red[kRow], green[kRow], blue[kRow], weight[kRow], nearest[kRow];
};

// Sums to sRGB bytes; background where nothing weighs.
void encode(const SumRow& sum, int count, const std::array<std::uint8_t, 3>& background,
            std::uint8_t* __restrict rgb, Cover* __restrict cover);

}  // namespace organbake
