// SPDX-License-Identifier: Apache-2.0
#include "finishing/tool_shadows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace organbake {
namespace {

constexpr int kSide = 200;
constexpr float kSkin_mm = 80;

// A wall of grey skin across the whole view, 250 pixels a unit of slope.
Frame wall_of_skin() {
  Frame frame;
  frame.color = Rgb8Image(kSide, kSide);
  std::fill(frame.color.pixels.begin(), frame.color.pixels.end(), std::uint8_t{150});
  frame.cover.assign(kSide * kSide, Cover::samples);
  frame.depth_mm.assign(kSide * kSide, kSkin_mm);
  return frame;
}

View straight() {
  View view;
  view.camera.intrinsics = {kSide, kSide, 250, 250, kSide / 2.0, kSide / 2.0};
  return view;
}

// A rod along the columns whose surface lies so far before the skin.
std::vector<Solid> rod_before_skin(double gap_mm) {
  Solid rod;
  rod.radius_mm = 2;
  rod.from = Eigen::Vector3d(0, -30, kSkin_mm - rod.radius_mm - gap_mm);
  rod.to = Eigen::Vector3d(0, 30, kSkin_mm - rod.radius_mm - gap_mm);
  return {rod};
}

Frame shaded(const std::vector<Solid>& solids, const Eigen::Vector3d& light_mm) {
  Frame frame = wall_of_skin();
  const View view = straight();
  shade_skin_by_solids(solids, solid_blocks(with_shadows(solids), view), view, light_mm, frame);
  return frame;
}

int green_at(const Frame& frame, double x_mm) {
  return frame.color.at(static_cast<int>(kSide / 2 + 250 * x_mm / kSkin_mm), kSide / 2)[1];
}

// The light is to the right of the eye, so that the shadow lies to the left of the rod: where the
// line from the light along the rod's left side meets the skin.
TEST(ToolShadows, LieWhereTheWayToTheLightIsBarred) {
  const Eigen::Vector3d light(20, 0, 0);
  const Frame frame = shaded(rod_before_skin(2), light);
  constexpr double kShadow_mm = -20.0 * 4 / (kSkin_mm - 4);  // of the rod's axis
  EXPECT_LT(green_at(frame, kShadow_mm), 120);
  EXPECT_GT(green_at(frame, -2 * kShadow_mm), green_at(frame, kShadow_mm) + 20);
  EXPECT_EQ(green_at(frame, 25), 150);
  // With the light on the other side, so is the shadow.
  const Frame mirrored = shaded(rod_before_skin(2), {-20, 0, 0});
  EXPECT_NEAR(green_at(mirrored, -kShadow_mm), green_at(frame, kShadow_mm), 4);
}

TEST(ToolShadows, FadeAsTheToolLeavesTheSkin) {
  int last = 0;
  for (const double gap_mm : {0.2, 1.5, 4.0, 7.0}) {
    int darkest = 255;
    const Frame frame = shaded(rod_before_skin(gap_mm), {4, -3, 0});
    for (double x = -20; x <= 20; x += 0.3) darkest = std::min(darkest, green_at(frame, x));
    EXPECT_GT(darkest, last) << gap_mm << " mm";
    last = darkest;
  }
  EXPECT_EQ(shaded(rod_before_skin(9), {4, -3, 0}).color.pixels, wall_of_skin().color.pixels);
}

// Seen aslant, wet skin shows the rod that stands on it.
TEST(ToolShadows, WetSkinMirrorsWhatTouchesIt) {
  Frame frame = wall_of_skin();
  const View view = straight();
  // A floor that falls away from the eye: 20 mm below it, from 60 mm on.
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const double slope = (y + 0.5 - kSide / 2.0) / 250;
      frame.depth_mm[std::size_t(y) * kSide + x] =
          slope > 0.05 ? static_cast<float>(20 / slope) : std::numeric_limits<float>::infinity();
    }
  std::fill(frame.color.pixels.begin(), frame.color.pixels.end(), std::uint8_t{0});
  Solid rod;
  rod.from = Eigen::Vector3d(0, 19, 90);
  rod.to = Eigen::Vector3d(0, -20, 90);
  rod.radius_mm = 2;
  shade_skin_by_solids({rod}, solid_blocks(with_shadows({rod}), view), view, {4, -3, 0}, frame);
  // The image of the rod's foot lies before it: nearer to the eye.
  int brightest = 0;
  for (int y = kSide / 2 + 56; y < kSide / 2 + 70; ++y)
    brightest = std::max(brightest, int(frame.color.at(kSide / 2, y)[1]));
  EXPECT_GT(brightest, 3);
}

}  // namespace
}  // namespace organbake
