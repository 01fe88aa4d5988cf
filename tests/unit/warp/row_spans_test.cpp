// SPDX-License-Identifier: Apache-2.0
#include "picture/row_spans.h"

#include <gtest/gtest.h>

namespace organbake {
namespace {

constexpr PixelBox kTile{512, 256, 512 + TileGrid::kWidth, 256 + TileGrid::kHeight};

bool within(const RowSpans& spans, const PixelBox& box) {
  for (int y = box.y0; y < box.y1; ++y) {
    const int row = y - kTile.y0;
    if (spans.first(row) > box.x0 - kTile.x0 || spans.last(row) < box.x1 - kTile.x0) return false;
  }
  return true;
}

bool empty(const RowSpans& spans, int row) { return spans.first(row) >= spans.last(row); }

TEST(RowSpans, HoldEveryBoxAndLeaveFarRowsEmpty) {
  RowSpans spans;
  spans.clear(kTile);
  const PixelBox one{520, 263, 540, 265}, other{600, 264, 601, 300};  // across bands of rows
  spans.add(one);
  spans.add(other);
  EXPECT_TRUE(within(spans, one));
  EXPECT_TRUE(within(spans, other));
  EXPECT_TRUE(empty(spans, 0));
  EXPECT_TRUE(empty(spans, 310 - kTile.y0));
  EXPECT_EQ(spans.first(299 - kTile.y0), 600 - kTile.x0);
}

TEST(RowSpans, AreCutAtTheTile) {
  RowSpans spans;
  spans.clear(kTile);
  spans.add({0, 0, 100, 2000});                             // beside it
  spans.add({kTile.x0, kTile.y1, kTile.x1, kTile.y1 + 1});  // below
  for (int row = 0; row < TileGrid::kHeight; ++row) ASSERT_TRUE(empty(spans, row));
  spans.add({0, 0, 4000, 4000});
  EXPECT_EQ(spans.first(0), 0);
  EXPECT_EQ(spans.last(TileGrid::kHeight - 1), TileGrid::kWidth);
}

TEST(RowSpans, JoinThoseOfOtherLayers) {
  RowSpans left, right;
  left.clear(kTile);
  right.clear(kTile);
  const PixelBox a{512, 256, 520, 260}, b{660, 256, 670, 270};
  left.add(a);
  right.add(b);
  left.add(right);
  EXPECT_TRUE(within(left, a));
  EXPECT_TRUE(within(left, b));
}

}  // namespace
}  // namespace organbake
