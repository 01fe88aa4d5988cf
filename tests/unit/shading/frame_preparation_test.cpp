// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/frame_preparation.h"

#include <gmock/gmock.h>

#include <cmath>

#include "organbake/core/error.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/shading/prepared_frame.h"

namespace organbake {
namespace {

StoredPicture numbered(int width, int height) {
  StoredPicture picture(Rgb8Image(width, height));
  for (std::size_t i = 0; i < picture.color.pixels.size(); ++i) {
    picture.color.pixels[i] = static_cast<std::uint8_t>(5 * i);
    picture.linear.push_back(static_cast<float>(i));
  }
  return picture;
}

// Where Exif says that the stored pixel (x, y) is seen.
std::pair<int, int> seen_at(Turn turn, int x, int y, int width, int height) {
  switch (turn) {
    case Turn::none:
      return {x, y};
    case Turn::mirror:
      return {width - 1 - x, y};
    case Turn::half:
      return {width - 1 - x, height - 1 - y};
    case Turn::flip:
      return {x, height - 1 - y};
    case Turn::transpose:
      return {y, x};
    case Turn::clockwise:
      return {height - 1 - y, x};
    case Turn::transverse:
      return {height - 1 - y, width - 1 - x};
    case Turn::counterclockwise:
      return {y, width - 1 - x};
  }
  return {};
}

TEST(Upright, EveryTurnPutsPixelsWhereExifSays) {
  for (int value = 1; value <= 8; ++value) {
    const StoredPicture stored = numbered(5, 3);
    StoredPicture picture = stored;
    picture.turn = static_cast<Turn>(value);
    const PixelSize size = upright_size(picture);
    make_upright(picture);
    ASSERT_EQ((PixelSize{picture.color.width, picture.color.height}), size);
    ASSERT_EQ(size.width, value >= 5 ? 3 : 5);
    for (int y = 0; y < 3; ++y)
      for (int x = 0; x < 5; ++x) {
        const auto [u, v] = seen_at(static_cast<Turn>(value), x, y, 5, 3);
        EXPECT_EQ(picture.color.at(u, v)[1], stored.color.at(x, y)[1]) << "turn " << value;
        EXPECT_EQ(picture.linear[3 * (std::size_t(v) * size.width + u)],
                  stored.linear[3 * (std::size_t(y) * 5 + x)]);
      }
    EXPECT_EQ(picture.turn, Turn::none);
  }
}

TEST(Upright, OblongPixelsBecomeSquareByDividingThem) {
  StoredPicture wide = numbered(20, 30), high = wide, odd = wide;
  wide.pixel_aspect = 2;
  make_upright(wide);
  EXPECT_EQ(wide.color.width, 40);
  EXPECT_EQ(wide.color.height, 30);
  high.pixel_aspect = 0.5;
  make_upright(high);
  EXPECT_EQ(high.color.width, 20);
  EXPECT_EQ(high.color.height, 60);
  EXPECT_EQ(high.linear.size(), 3u * 20 * 60);
  odd.pixel_aspect = 300;
  EXPECT_THROW(make_upright(odd), BadDataError);
}

TEST(StereoFrame, TwoEyesInOneFrameAreNoticedAndOneEyeIsNot) {
  const LaparoscopyPhantom phantom({.width = 320, .height = 240, .frames = 40});
  const Rgb8Image left = phantom.frame(0).image, right = phantom.frame(1).image;  // a little aside
  EXPECT_EQ(find_stereo_layout(left), StereoLayout::none);
  Rgb8Image beside(640, 240), below(320, 480);
  for (int y = 0; y < 240; ++y) {
    std::copy_n(left.at(0, y), 960, beside.at(0, y));
    std::copy_n(right.at(0, y), 960, beside.at(320, y));
  }
  std::copy(left.pixels.begin(), left.pixels.end(), below.pixels.begin());
  std::copy(right.pixels.begin(), right.pixels.end(), below.at(0, 240));
  EXPECT_EQ(find_stereo_layout(beside), StereoLayout::side_by_side);
  EXPECT_EQ(find_stereo_layout(below), StereoLayout::top_bottom);
}

// Two fields of a grey disc, `apart` pixels to the right of each other.
Rgb8Image two_fields(int apart) {
  Rgb8Image image(160, 120);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) {
      const double right = x - 80 - (y % 2 ? apart : 0);
      std::fill_n(image.at(x, y), 3, std::uint8_t(std::hypot(right, y - 60) < 40 ? 180 : 60));
    }
  return image;
}

TEST(Combs, AreOfTwoFieldsAndNotOfAPalettesDither) {
  EXPECT_TRUE(is_combed(two_fields(6)));
  EXPECT_FALSE(is_combed(two_fields(0)));
  // A slow slope in a palette of six greys, its rest spread to the neighbours (Floyd & Steinberg).
  Rgb8Image dithered(160, 120);
  Plane rest(161, 121);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) {
      const float wanted = 60 + 0.7F * static_cast<float>(x) + rest.at(x, y);
      const float level = 50 * std::round(wanted / 50), left = wanted - level;
      std::fill_n(dithered.at(x, y), 3, static_cast<std::uint8_t>(level));
      rest.at(x + 1, y) += left * 7 / 16;
      rest.at(x, y + 1) += left * 5 / 16;
      if (x > 0) rest.at(x - 1, y + 1) += left * 3 / 16;
      rest.at(x + 1, y + 1) += left / 16;
    }
  EXPECT_FALSE(is_combed(dithered));
  // An ordered one: every second pixel of every second row.
  Rgb8Image ordered(160, 120);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x)
      std::fill_n(ordered.at(x, y), 3, std::uint8_t((x + y) % 2 ? 100 : 140));
  EXPECT_FALSE(is_combed(ordered));
}

TEST(Brightness, OfAStroboscopeJumpsAndThatOfAnExposureGoesAlong) {
  EXPECT_NEAR(brightness(two_fields(0)), 60 + 120 * 3.14159 * 40 * 40 / (160 * 120), 1);
  std::vector<double> strobe, exposure, cuts;
  for (int i = 0; i < 30; ++i) {
    strobe.push_back(i % 2 ? 90 : 20);
    exposure.push_back(60 * std::exp(0.5 * std::sin(0.4 * i)));
    cuts.push_back(i / 10 == 1 ? 20 : 90);
  }
  EXPECT_TRUE(flickers(strobe));
  EXPECT_FALSE(flickers(exposure));
  EXPECT_FALSE(flickers(cuts));
  EXPECT_FALSE(flickers({}));
}

TEST(Squares, OfAMosaicAreMeasured) {
  const Rgb8Image plain = LaparoscopyPhantom({.width = 320, .height = 240}).frame(0).image;
  EXPECT_EQ(squares_px(plain), 1);
  for (const int side : {2, 5, 8, 16}) {
    Rgb8Image coarse = plain;
    for (int y = 0; y < 240; ++y)
      for (int x = 0; x < 320; ++x)
        std::copy_n(plain.at(x - x % side, y - y % side), 3, coarse.at(x, y));
    EXPECT_EQ(squares_px(coarse), side);
  }
  EXPECT_EQ(squares_px(Rgb8Image(64, 48)), 1) << "of one colour";
}

}  // namespace
}  // namespace organbake
