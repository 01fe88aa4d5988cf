// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "unit/warp/filled_frame.h"

namespace organbake {
namespace {

constexpr int kSide = 40;
constexpr PixelBox kAll{0, 0, kSide, kSide};

// A grey square on black.
Frame square(int first, int last) {
  Frame frame;
  frame.color = Rgb8Image(kSide, kSide);
  frame.cover.assign(kSide * kSide, Cover::background);
  for (int y = first; y < last; ++y) {
    for (int x = first; x < last; ++x) {
      frame.cover[y * kSide + x] = Cover::samples;
      for (int k = 0; k < 3; ++k) frame.color.at(x, y)[k] = 100;
    }
  }
  return frame;
}

void open(Frame& frame, int x, int y) {
  frame.cover[y * kSide + x] = Cover::background;
  for (int k = 0; k < 3; ++k) frame.color.at(x, y)[k] = 0;
}

TEST(HoleFill, LeavesAWholeShapeAlone) {
  Frame frame = square(8, 30);
  const auto before = frame.color.pixels;
  const HoleCounts counts = holes_filled_in(kAll, true, frame);
  EXPECT_EQ(counts.before, 0u);
  EXPECT_EQ(counts.after, 0u);
  EXPECT_EQ(slits_filled_in(kAll, true, frame), 0u);
  EXPECT_EQ(frame.color.pixels, before);
}

TEST(HoleFill, ClosesPinholesWithTheirNeighbours) {
  Frame frame = square(8, 30);
  for (const auto& [x, y] : {std::pair{12, 12}, {20, 15}, {21, 15}, {25, 25}}) open(frame, x, y);
  const HoleCounts counts = holes_filled_in(kAll, true, frame);
  EXPECT_EQ(counts.before, 4u);
  EXPECT_EQ(counts.after, 0u);
  EXPECT_EQ(frame.color.at(20, 15)[1], 100);
  EXPECT_EQ(frame.cover[15 * kSide + 20], Cover::filled);
}

TEST(HoleFill, OnlyCountsWhenNotAskedToFill) {
  Frame frame = square(8, 30);
  open(frame, 12, 12);
  const HoleCounts counts = holes_filled_in(kAll, false, frame);
  EXPECT_EQ(counts.before, 1u);
  EXPECT_EQ(counts.after, 1u);
  EXPECT_FALSE(frame.covered(12, 12));
}

TEST(SlitFill, BridgesANarrowSlitButNotAGapBetweenLobes) {
  for (const bool along_rows : {true, false}) {
    for (int wide = 1; wide <= kWidestSlit + 2; ++wide) {
      Frame frame = square(4, 36);
      for (int i = 4; i < 36; ++i) {
        for (int w = 0; w < wide; ++w) along_rows ? open(frame, i, 15 + w) : open(frame, 15 + w, i);
      }
      const std::size_t filled = slits_filled_in(kAll, true, frame);
      EXPECT_EQ(filled, wide <= kWidestSlit ? std::size_t(32) * wide : 0u) << wide;
      EXPECT_EQ(frame.covered(15, 15), wide <= kWidestSlit);
    }
  }
}

TEST(SlitFill, NeedsCoverAtBothEnds) {
  Frame frame = square(2, kSide);  // reaches two borders of the picture
  EXPECT_EQ(slits_filled_in(kAll, true, frame), 0u);
  EXPECT_FALSE(frame.covered(1, 20));
}

}  // namespace
}  // namespace organbake
