// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "drawing/tile_keys.h"
#include "picture/tile_grid.h"
#include "picture/vector_loops.h"
#include "placing/chunk_frame.h"
#include "placing/placed_faces.h"
#include "samples/sample_set.h"

namespace organbake {

// How a pixel of a tile becomes the number of its cell.
struct CellGrid {
  int stride, guard;  // cells of a row; beyond each of the tile's borders

  int column(std::int32_t cell) const { return cell % stride - guard; }
  int row(std::int32_t cell) const { return cell / stride - guard; }
};
// For splats that may begin farther outside than a tile's own guard band.
inline constexpr CellGrid kAnySplat{1024, kMostSplat + 1};
static_assert(TileGrid::kWidth + 2 * kAnySplat.guard <= kAnySplat.stride);
static_assert((TileGrid::kHeight + 2 * kAnySplat.guard) * kAnySplat.stride <= 1 << 24);  // a float

// Where those of a chunk's samples land that touch a tile: offset from each to its first pixel's
// centre, depth, and that pixel's cell.
struct PlacedSamples {
  using Numbers = std::array<std::uint32_t, kChunk>;
  static_assert(kChunk % kLanes == 0);

  int count;
  const Numbers* sample;  // which of the chunk's each is
  alignas(64) std::array<float, kChunk> u, v, z;
  alignas(64) std::array<std::int32_t, kChunk> cell;
  alignas(64) Numbers inside, left;  // of a chunk that the tile cuts
};

void place_samples(const SampleSet& set, std::uint32_t chunk, const ChunkFrame& frame,
                   const FaceFrame& face, float near_mm, const TileKeys& tile,
                   const CellGrid& cells, PlacedSamples& placed);

}  // namespace organbake
