// SPDX-License-Identifier: GPL-3.0-or-later
// Detail that halving takes comes back from the frame, but not into what was filled.
#include "organbake/shading/own_pixels.h"

#include <gtest/gtest.h>

#include <cstdlib>

namespace organbake {
namespace {

TEST(OwnPixels, BringBackWhatHalvingTook) {
  constexpr int kWidth = 65, kHeight = 40;  // an odd column falls away
  Rgb8Image frame(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) frame.at(x, y)[c] = (x + y) % 2 ? 130 : 110;
  PreparedFrame reduced;
  reduced.color = half_size(frame);
  reduced.diffuse = Mask(reduced.color.width, reduced.color.height, 1);
  for (int y = 0; y < reduced.diffuse.height; ++y)
    for (int x = 0; x < 8; ++x) reduced.diffuse.at(x, y) = 0;
  Rgb8Image brighter = reduced.color;  // as where light is divided out
  for (std::uint8_t& value : brighter.pixels) value = 200;

  const Rgb8Image same = with_own_pixels(reduced.color, reduced, frame, 1);
  ASSERT_EQ(same.width, kWidth);
  ASSERT_EQ(same.height, kHeight);
  const Rgb8Image lit = with_own_pixels(brighter, reduced, frame, 1);
  const auto step = [](const Rgb8Image& image, int x) {
    return std::abs(image.at(x, 20)[1] - image.at(x + 1, 20)[1]);
  };
  EXPECT_NEAR(step(frame, 40), 20, 0);
  EXPECT_NEAR(step(same, 40), 20, 3);
  EXPECT_NEAR(step(same, 63), 20, 3) << "the last column";
  EXPECT_NEAR(step(lit, 40), 20, 3) << "no louder than the frame has it";
  EXPECT_EQ(step(same, 5), 0) << "filled, so smooth";
}

}  // namespace
}  // namespace organbake
