// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "organbake/warp/pixel_box.h"
#include "picture/tile_grid.h"
#include "placing/dirty_cells.h"

namespace organbake {

// A part of a tile, which one thread draws. All of the tile that is drawn in this frame is `drawn`.
struct TilePart {
  int tile = 0;
  PixelBox tile_box, drawn, box;
  double cost = 0;
  double took_ms = 0;  // once it is drawn
};

// Shares a frame's tiles out so that no thread waits long for another: those that cost the most, by
// what they took in the last frame, are split, and the dearest parts come first. What a pixel shows
// does not depend on the part that it lies in.
class TilePlan {
 public:
  // What moved of each tile, as parts for that many threads. items_of(tile): how many chunks and
  // blocks are listed there.
  void make(const TileGrid& grid, DirtyCells& cells, int threads,
            const std::function<std::size_t(int tile)>& items_of);
  std::span<TilePart> parts() { return parts_; }
  int tile_count() const { return tile_count_; }  // that have parts
  // Remembers what the parts took, for the next frame.
  void learn();

 private:
  double ms_per_item(int tile) const;
  void list_tiles(const TileGrid& grid, DirtyCells& cells);
  void split(const TilePart& whole, int pieces);

  std::vector<TilePart> whole_, parts_;
  std::vector<std::size_t> items_;   // by tile
  std::vector<double> ms_per_item_;  // by tile, 0 where it is not known
  double mean_ms_per_item_ = 1;
  int tile_count_ = 0;
};

}  // namespace organbake
