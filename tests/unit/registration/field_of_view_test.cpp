// SPDX-License-Identifier: GPL-3.0-or-later
#include "appearance/photo_pyramid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "lamp_studio.h"

namespace organbake {
namespace {

Rgb8Image round_picture(int width, int height, double radius) {
  Rgb8Image image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (std::hypot(x + 0.5 - width / 2.0 - 4, y + 0.5 - height / 2.0) < radius)
        std::fill_n(image.at(x, y), 3, std::uint8_t(90 + (x * 7 + y * 3) % 60));
  return image;
}

TEST(RoundField, IsFoundWholeOrCutByTheEdges) {
  for (const double radius : {140.0, 190.0}) {
    const Rgb8Image image = round_picture(400, 300, radius);
    const auto inside = inside_round_field(image);
    int wrong = 0, in = 0;
    for (int y = 0; y < 300; ++y)
      for (int x = 0; x < 400; ++x) {
        const double r = std::hypot(x + 0.5 - 204, y + 0.5 - 150);
        in += inside[y * 400 + x];
        wrong += inside[y * 400 + x] && r > radius;
        wrong += !inside[y * 400 + x] && r < radius - 6;
      }
    EXPECT_EQ(wrong, 0) << "radius " << radius;
    EXPECT_GT(in, 1000);
  }
}

TEST(RoundField, ADarkBackgroundIsNone) {
  Rgb8Image photo = develop(lamp_studio().plain, {.offset = 0, .noise = 0});
  const auto inside = inside_round_field(photo);
  EXPECT_EQ(std::count(inside.begin(), inside.end(), 0), 0);
}

TEST(ValidPixels, LeaveOutMaskAndBlownOnes) {
  Rgb8Image photo(40, 30), mask(40, 30);
  std::fill(photo.pixels.begin(), photo.pixels.end(), 100);
  std::fill(mask.pixels.begin(), mask.pixels.end(), 255);
  std::fill_n(photo.at(20, 10), 3, 255);
  std::fill_n(mask.at(5, 5), 3, 0);
  const auto valid = valid_pixels(photo, mask);
  EXPECT_EQ(std::count(valid.begin(), valid.end(), 0), 9 + 1) << "the blown one's neighbours, too";
  EXPECT_EQ(valid[5 * 40 + 5], 0);
}

}  // namespace
}  // namespace organbake
