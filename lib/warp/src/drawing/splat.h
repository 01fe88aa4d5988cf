// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "drawing/tile_keys.h"
#include "placing/chunk_frame.h"
#include "placing/placed_faces.h"
#include "samples/sample_set.h"

namespace organbake {

// Sends for what splat_chunk() will read of a chunk, and for the colours that the tile's pixels
// will ask for in another order: they come while chunks before it are drawn. A frame in a twentieth
// less time. smooth: by SampleSet::smooth.
void prefetch_chunk(const SampleSet& set, std::uint32_t chunk, bool smooth);

// Draws a chunk's samples into the tile. tie_mm = kTieTexels × texel size. What does not fall
// into the tile, lies before the near plane or loses its pixel leaves no trace.
void splat_chunk(const SampleSet& set, std::uint32_t chunk, const ChunkFrame& frame,
                 const FaceFrame& face, float near_mm, float tie_mm, TileKeys& tile);

}  // namespace organbake
