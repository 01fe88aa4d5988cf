// SPDX-License-Identifier: Apache-2.0
#include "drawing/open_pixels.h"

#include <gtest/gtest.h>

#include "drawing/tile_keys.h"
#include "organbake/core/random.h"

namespace organbake {
namespace {

// Two layers of random keys over a tile of a given size.
void check_tile(const PixelBox& tile) {
  RandomStream random(std::uint64_t(tile.width()) * 1000 + tile.height());
  std::array<TileKeys, 2> layers;
  for (TileKeys& layer : layers) {
    layer.clear(tile, tile);
    for (std::uint64_t& key : layer.keys) {
      if (random.uniform(0, 1) < 0.7) key = 12345;  // the guard band too: it must not count
    }
  }
  const std::array<const TileKeys*, 2> both = {&layers[0], &layers[1]};
  OpenPixels open;
  open.find(tile, both);
  const auto expected = [&](int x, int y) {
    return layers[0].row(y)[x - tile.x0] == kEmptyKey && layers[1].row(y)[x - tile.x0] == kEmptyKey;
  };
  for (int y = tile.y0; y < tile.y1; ++y) {
    for (int x = tile.x0; x < tile.x1; ++x)
      ASSERT_EQ(open.at(x, y), expected(x, y)) << x << ',' << y;
  }
  for (int round = 0; round < 200; ++round) {
    const int x0 = tile.x0 + int(random.uniform(-5, tile.width())),
              y0 = tile.y0 + int(random.uniform(-5, tile.height()));
    const PixelBox box{x0, y0, x0 + int(random.uniform(0, 4)), y0 + int(random.uniform(0, 4))};
    bool any = false;
    const PixelBox inside = intersected(box, tile);
    for (int y = inside.y0; y < inside.y1; ++y) {
      for (int x = inside.x0; x < inside.x1; ++x) any |= expected(x, y);
    }
    ASSERT_EQ(open.any(box), any);
  }
}

TEST(OpenPixels, AreThoseThatNoLayerTook) {
  constexpr int kWidth = TileGrid::kWidth, kHeight = TileGrid::kHeight;
  check_tile({kWidth, kHeight, 2 * kWidth, 2 * kHeight});
  check_tile({0, 0, kWidth, 7});
  check_tile({2 * kWidth, 0, 2 * kWidth + 65, kHeight});
  check_tile({3, 5, 4, 6});
}

}  // namespace
}  // namespace organbake
