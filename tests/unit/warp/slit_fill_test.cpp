// SPDX-License-Identifier: Apache-2.0
#include "finishing/slit_fill.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "unit/warp/filled_frame.h"

namespace organbake {
namespace {

Frame grey_frame(int width, int height) {
  Frame frame;
  frame.color = Rgb8Image(width, height);
  std::fill(frame.color.pixels.begin(), frame.color.pixels.end(), std::uint8_t{100});
  frame.cover.assign(std::size_t(width) * height, Cover::samples);
  return frame;
}

void open(Frame& frame, int x0, int y0, int x1, int y1) {
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      frame.cover[std::size_t(y) * frame.color.width + x] = Cover::background;
      std::fill_n(frame.color.at(x, y), 3, std::uint8_t{0});
    }
  }
}

std::size_t open_pixels(const Frame& frame) {
  return std::count(frame.cover.begin(), frame.cover.end(), Cover::background);
}

TEST(FillSlits, ClosesLongThinOnesEitherWay) {
  Frame frame = grey_frame(150, 90);
  open(frame, 10, 20, 140, 22);
  open(frame, 70, 40, 73, 88);
  EXPECT_EQ(slits_filled_in({0, 0, 150, 90}, true, frame), 130u * 2 + 3u * 48);
  EXPECT_EQ(open_pixels(frame), 0u);
  EXPECT_EQ(frame.color.at(75, 21)[0], 100);
}

TEST(FillSlits, MixesFromEndToEnd) {
  Frame frame = grey_frame(9, 9);
  open(frame, 0, 4, 9, 5);
  std::fill_n(frame.color.at(3, 3), 3, std::uint8_t{50});
  slits_filled_in({0, 0, 9, 9}, true, frame);
  EXPECT_EQ(frame.color.at(3, 4)[0], 75);
}

TEST(FillSlits, LeavesWideGapsAndTheOutsideAlone) {
  Frame frame = grey_frame(100, 100);
  open(frame, 20, 20, 60, 20 + kWidestSlit + 1);
  open(frame, 0, 97, 100, 100);  // open to the picture's border
  const std::size_t before = open_pixels(frame);
  EXPECT_EQ(slits_filled_in({0, 0, 100, 100}, true, frame), 0u);
  EXPECT_EQ(open_pixels(frame), before);
}

TEST(FillSlits, OnlyCountsWhenToldTo) {
  Frame frame = grey_frame(20, 20);
  open(frame, 5, 5, 15, 6);
  EXPECT_EQ(slits_filled_in({0, 0, 20, 20}, false, frame), 10u);
  EXPECT_EQ(open_pixels(frame), 10u);
}

}  // namespace
}  // namespace organbake
