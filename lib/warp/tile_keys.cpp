// SPDX-License-Identifier: Apache-2.0
#include "warp/tile_keys.h"

#include "warp/pixel_key.h"

namespace organbake {

void TileKeys::clear(const PixelBox& tile, const PixelBox& part) {
  box = part;
  origin_x = tile.x0, origin_y = tile.y0;
  stride = part.width() + 2 * kGuard;
  keys.assign(std::size_t(stride) * (part.height() + 2 * kGuard), kEmptyKey);
}

}  // namespace organbake
