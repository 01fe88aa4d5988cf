// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "warp/draw_state.h"
#include "warp/pixel_key.h"
#include "warp/sample_set.h"

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

  void clear(const PixelBox& tile, const PixelBox& part);
  const std::uint64_t* row(int y) const {  // y of the picture
    return keys.data() + std::size_t(y - box.y0 + kGuard) * stride + kGuard;
  }
};

// Sends for what splat_chunk() will read of a chunk, and for the colours that the tile's pixels
// will ask for in another order: they come while chunks before it are drawn. A frame in a twentieth
// less time.
void send_for_chunk(const SampleSet& set, std::uint32_t chunk);

// Draws a chunk's samples into the tile. tie_mm = kTieTexels × texel size. What does not fall
// into the tile, lies before the near plane or loses its pixel leaves no trace.
void splat_chunk(const SampleSet& set, std::uint32_t chunk, const ChunkFrame& frame,
                 const FaceFrame& face, float near_mm, float tie_mm, TileKeys& tile);

}  // namespace organbake
