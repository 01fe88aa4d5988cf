// SPDX-License-Identifier: Apache-2.0
#include "drawing/tile_plan.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace organbake {
namespace {

constexpr int kTiledWidth = 400, kTiledHeight = 300;  // tiles of whole size, and cut ones
const TileGrid kGrid(kTiledWidth, kTiledHeight);

// Tile 1 holds much, tile 5 little, the others nothing.
std::size_t items_of(int tile) { return tile == 1 ? 1000 : tile == 5 ? 100 : 0; }

std::vector<TilePart> parts_for(int threads, DirtyCells& cells) {
  TilePlan plan;
  plan.make(kGrid, cells, threads, items_of);
  return {plan.parts().begin(), plan.parts().end()};
}

DirtyCells all_dirty() {
  DirtyCells cells;
  cells.reset(kTiledWidth, kTiledHeight, true);
  return cells;
}

TEST(TilePlan, OneThreadDrawsWholeTiles) {
  DirtyCells cells = all_dirty();
  const std::vector<TilePart> parts = parts_for(1, cells);
  ASSERT_EQ(parts.size(), std::size_t(kGrid.count()));
  for (const TilePart& part : parts) EXPECT_EQ(part.box, kGrid.box(part.tile));
}

TEST(TilePlan, PartsCoverEachPixelOnce) {
  for (const int threads : {1, 2, 3, 8, 64}) {
    DirtyCells cells = all_dirty();
    std::vector<int> drawn(std::size_t(kTiledWidth) * kTiledHeight, 0);
    for (const TilePart& part : parts_for(threads, cells)) {
      EXPECT_EQ(intersected(part.box, kGrid.box(part.tile)), part.box);
      for (int y = part.box.y0; y < part.box.y1; ++y)
        for (int x = part.box.x0; x < part.box.x1; ++x) ++drawn[std::size_t(y) * kTiledWidth + x];
    }
    EXPECT_EQ(std::count(drawn.begin(), drawn.end(), 1), std::ssize(drawn)) << threads;
  }
}

TEST(TilePlan, SplitsTheDearTileAndBeginsWithIt) {
  DirtyCells cells = all_dirty();
  const std::vector<TilePart> parts = parts_for(2, cells);
  const auto of_tile = [&](int tile) {
    return std::count_if(parts.begin(), parts.end(),
                         [&](const TilePart& part) { return part.tile == tile; });
  };
  EXPECT_GT(of_tile(1), 1);
  EXPECT_EQ(of_tile(5), 1);
  EXPECT_EQ(parts.front().tile, 1);
  EXPECT_TRUE(std::is_sorted(parts.begin(), parts.end(),
                             [](const TilePart& a, const TilePart& b) { return a.cost > b.cost; }));
}

TEST(TilePlan, GoesByWhatTheLastFrameTook) {
  DirtyCells cells = all_dirty();
  TilePlan plan;
  plan.make(kGrid, cells, 2, items_of);
  for (TilePart& part : plan.parts()) part.took_ms = part.tile == 5 ? 9 : 0.1;
  plan.learn();
  plan.make(kGrid, cells, 2, items_of);
  EXPECT_EQ(plan.parts().front().tile, 5);
}

TEST(TilePlan, DrawsWhatMovedAlone) {
  DirtyCells cells;
  cells.reset(kTiledWidth, kTiledHeight, false);
  cells.mark({200, 10, 210, 20});
  for (const int threads : {1, 8}) {
    const std::vector<TilePart> parts = parts_for(threads, cells);
    ASSERT_EQ(parts.size(), 1u);
    EXPECT_EQ(parts[0].tile, 1);
    EXPECT_EQ(parts[0].box, (PixelBox{192, 0, 224, 32}));
  }
}

}  // namespace
}  // namespace organbake
