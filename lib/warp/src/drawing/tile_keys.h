// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "drawing/pixel_key.h"
#include "organbake/warp/pixel_box.h"

namespace organbake {

// Keys of one camera over one tile of the picture, or a part of it, with a guard band all round so
// that a splat over the border needs no test per pixel.
struct TileKeys {
  static constexpr int kGuard = 8;

  PixelBox box;
  // The tile's corner. Samples are placed from there, whatever part is drawn: rounding differs from
  // corner to corner, a part must not.
  int origin_x = 0, origin_y = 0;
  int stride = 0;
  std::vector<std::uint64_t> keys;

  void clear(const PixelBox& tile, const PixelBox& part) {
    box = part;
    origin_x = tile.x0, origin_y = tile.y0;
    stride = part.width() + 2 * kGuard;
    keys.assign(std::size_t(stride) * (part.height() + 2 * kGuard), kEmptyKey);
  }
  const std::uint64_t* row(int y) const {  // y of the picture
    return keys.data() + std::size_t(y - box.y0 + kGuard) * stride + kGuard;
  }
};

}  // namespace organbake
