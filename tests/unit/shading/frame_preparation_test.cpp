// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/frame_preparation.h"

#include <gmock/gmock.h>

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

}  // namespace
}  // namespace organbake
