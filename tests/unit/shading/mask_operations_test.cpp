// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "organbake/shading/grid_filters.h"
#include "organbake/shading/masks.h"

namespace organbake {
namespace {

// A mask drawn with characters: '#' counts, anything else does not.
Mask drawn(const std::vector<std::string>& rows) {
  Mask mask(static_cast<int>(rows.front().size()), static_cast<int>(rows.size()));
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) mask.at(x, y) = rows[y][x] == '#';
  }
  return mask;
}

TEST(Masks, GrowAndShrinkBySquaresButNotFromTheFramesEdge) {
  const Mask dot = drawn({".....", ".....", "..#..", ".....", "....."});
  EXPECT_EQ(dilated(dot, 1), drawn({".....", ".###.", ".###.", ".###.", "....."}));
  EXPECT_EQ(eroded(dilated(dot, 1), 1), dot);
  const Mask left = drawn({"###..", "###..", "###.."});
  EXPECT_EQ(eroded(left, 1), drawn({"##...", "##...", "##..."}));
  EXPECT_EQ(dilated(dot, 0), dot);
}

TEST(Masks, RegionsAreJoinedBySidesNotByCorners) {
  const Mask mask = drawn({"##...", "##...", "..#..", "..###"});
  EXPECT_EQ(largest_region(drawn({"#..", ".##"})), drawn({"...", ".##"}));
  const Mask first = drawn({"#....", ".....", ".....", "....."});
  EXPECT_EQ(regions_touching(mask, first), drawn({"##...", "##...", ".....", "....."}));
  EXPECT_EQ(largest_region(Mask(4, 3)), Mask(4, 3));
}

TEST(Masks, HolesAreWhatTheEdgeDoesNotReach) {
  EXPECT_EQ(with_holes_closed(drawn({".....", ".###.", ".#.#.", ".###."})),
            drawn({".....", ".###.", ".###.", ".###."}));
  const Mask open = drawn({".#.#.", ".#.#.", ".###."});
  EXPECT_EQ(with_holes_closed(open), open);
}

TEST(BoxMean, CountsInsidePixelsOnly) {
  Plane plane(3, 1);
  plane.values = {1, 100, 3};
  const Plane mean = box_mean(plane, drawn({"#.#"}), 1);
  EXPECT_FLOAT_EQ(mean.at(0, 0), 1);
  EXPECT_FLOAT_EQ(mean.at(1, 0), 2);
  EXPECT_FLOAT_EQ(mean.at(2, 0), 3);
  EXPECT_FLOAT_EQ(box_mean(plane, Mask(3, 1), 1).at(1, 0), 0);
}

}  // namespace
}  // namespace organbake
