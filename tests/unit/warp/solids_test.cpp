// SPDX-License-Identifier: Apache-2.0
#include "finishing/post_process.h"

#include "organbake/core/random.h"
#include "support/testing.h"

namespace organbake {
namespace {

constexpr int kWidth = 320, kHeight = 200;

Frame empty_frame() {
  Frame frame;
  frame.color = Rgb8Image(kWidth, kHeight);
  frame.cover.assign(kWidth * kHeight, Cover::background);
  frame.depth_mm.assign(kWidth * kHeight, std::numeric_limits<float>::infinity());
  return frame;
}

View straight_view() {
  View view;
  view.camera.intrinsics = {kWidth, kHeight, 250, 250, kWidth / 2.0, kHeight / 2.0};
  return view;
}

Solid shaft_to(const Eigen::Vector3d& end) {
  Solid solid;
  solid.from = Eigen::Vector3d(0, 0, 200);
  solid.to = end;
  solid.radius_mm = 2;
  return solid;
}

std::ptrdiff_t solid_pixels(const Frame& frame) {
  return std::count(frame.cover.begin(), frame.cover.end(), Cover::solid);
}

// Returns how many pixels.
std::ptrdiff_t draw(const std::vector<Solid>& solids, const View& view, Frame& frame,
                    bool in_cavity = false) {
  draw_solids(solids, solid_blocks(solids, view), view, in_cavity, frame);
  return solid_pixels(frame);
}

// Amid tissue a shaft is dark but for the lamp's streak along it, and as red beside that as what it
// mirrors; elsewhere it is grey and broadly lit.
TEST(DrawSolids, AShaftInACavityHasASharpStreakAndMirrorsTissue) {
  Solid shaft = shaft_to({0, 80, 100});
  shaft.from = {0, -80, 100}, shaft.radius_mm = 10;
  const View view = straight_view();
  Frame plain = empty_frame(), amid_tissue = empty_frame();
  draw({shaft}, view, plain), draw({shaft}, view, amid_tissue, true);
  const auto bright = [](const Frame& frame) {
    int count = 0;
    for (int x = 0; x < kWidth; ++x) count += frame.color.at(x, kHeight / 2)[1] > 170;
    return count;
  };
  EXPECT_GT(bright(amid_tissue), 0);
  EXPECT_LT(2 * bright(amid_tissue), bright(plain));
  const std::uint8_t* beside = amid_tissue.color.at(kWidth / 2 + 19, kHeight / 2);
  EXPECT_GT(beside[0], beside[2] + 8);
}

TEST(DrawSolids, BlocksHoldAllThatCanBeSeen) {
  RandomStream random(11);
  const auto place = [&] {
    return Eigen::Vector3d(random.uniform(-150, 150), random.uniform(-150, 150),
                           random.uniform(-60, 400));
  };
  View view = straight_view();
  view.near_mm = 5;
  for (int scene = 0; scene < 60; ++scene) {
    std::vector<Solid> solids(1 + random.below(4));
    for (Solid& solid : solids) {
      solid.from = solid.to = place();
      if (random.uniform(0, 1) < 0.8) solid.to = place();
      solid.radius_mm = random.uniform(0.2, 40);
    }
    std::vector<NumberedBox> all;
    for (std::uint32_t s = 0; s < solids.size(); ++s) all.push_back({s, {0, 0, kWidth, kHeight}});
    Frame blocks = empty_frame(), whole = empty_frame();
    draw_solids(solids, blocks_of(all, view), view, false, whole);
    EXPECT_EQ(draw(solids, view, blocks), solid_pixels(whole));
    EXPECT_EQ(blocks.color.pixels, whole.color.pixels) << "scene " << scene;
    EXPECT_EQ(blocks.depth_mm, whole.depth_mm) << "scene " << scene;
  }
}

TEST(DrawSolids, BlocksFollowAThinShaftAcrossThePicture) {
  Solid shaft = shaft_to({100, 60, 200});
  shaft.from = {-100, -60, 200};
  std::ptrdiff_t pixels = 0;
  for (const PictureBlock& block : solid_blocks({shaft}, straight_view()))
    pixels += std::ptrdiff_t(block.box.width()) * block.box.height();
  Frame frame = empty_frame();
  const std::ptrdiff_t touched = draw({shaft}, straight_view(), frame);
  EXPECT_LT(pixels, 8 * touched);
}

TEST(DrawSolids, AShaftThatLeadsOutOfThePictureReachesItsRim) {
  // Its far end lies beside the picture: below, to the left, and behind the eye.
  for (const Eigen::Vector3d& end :
       {Eigen::Vector3d(0, 150, 150), Eigen::Vector3d(-300, 0, 200), Eigen::Vector3d(0, 60, -30)}) {
    Frame frame = empty_frame();
    draw({shaft_to(end)}, straight_view(), frame);
    bool at_rim = false;
    for (int y = 0; y < kHeight; ++y)
      at_rim |= frame.cover[std::size_t(y) * kWidth] == Cover::solid;
    for (int x = 0; x < kWidth; ++x) {
      at_rim |= frame.cover[std::size_t(kHeight - 1) * kWidth + x] == Cover::solid;
    }
    EXPECT_TRUE(at_rim) << end.transpose();
  }
}

TEST(DrawSolids, WhatLiesBesideThePictureCostsNothing) {
  Frame frame = empty_frame();
  Solid solid = shaft_to({400, 0, 200});
  solid.from.x() = 300;
  EXPECT_EQ(draw({solid}, straight_view(), frame), 0);
}

TEST(DrawSolids, TissueInFrontHidesThem) {
  Frame frame = empty_frame();
  for (float& depth : frame.depth_mm) depth = 100;
  EXPECT_EQ(draw({shaft_to({20, 0, 200})}, straight_view(), frame), 0);
}

constexpr int kShadowedSide_px = 200;
constexpr float kSkin_mm = 80;

// A wall of grey skin across the whole view, 250 pixels a unit of slope.
Frame wall_of_skin() {
  Frame frame;
  frame.color = Rgb8Image(kShadowedSide_px, kShadowedSide_px);
  std::fill(frame.color.pixels.begin(), frame.color.pixels.end(), std::uint8_t{150});
  frame.cover.assign(kShadowedSide_px * kShadowedSide_px, Cover::samples);
  frame.depth_mm.assign(kShadowedSide_px * kShadowedSide_px, kSkin_mm);
  return frame;
}

View straight() {
  View view;
  view.camera.intrinsics = {kShadowedSide_px,       kShadowedSide_px,      250, 250,
                            kShadowedSide_px / 2.0, kShadowedSide_px / 2.0};
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
  KeptPixels kept;
  shade_skin_by_solids(solids, view, light_mm, frame, kept);
  return frame;
}

int channel_at(const Frame& frame, double x_mm, int channel) {
  return frame.color.at(static_cast<int>(kShadowedSide_px / 2 + 250 * x_mm / kSkin_mm),
                        kShadowedSide_px / 2)[channel];
}
int red_at(const Frame& frame, double x_mm) { return channel_at(frame, x_mm, 0); }
int green_at(const Frame& frame, double x_mm) { return channel_at(frame, x_mm, 1); }

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

// Colours alone: blood of skin beside a lip and of the wall below it, more red than that was; smoke
// of what lies behind its middle, and of nothing before it.
TEST(Wounds, ChangeColoursAlone) {
  const Frame dry = wall_of_skin();
  const View view = straight();
  KeptPixels kept;
  const std::vector<BloodLine> blood = {{{-4, 0, kSkin_mm},
                                         {4, 0, kSkin_mm},
                                         -Eigen::Vector3d::UnitZ(),
                                         Eigen::Vector3d::UnitY(),
                                         2,
                                         2}};
  Frame frame = dry;
  draw_blood(blood, view, std::nullopt, frame, kept);
  EXPECT_EQ(frame.depth_mm, dry.depth_mm);
  EXPECT_EQ(frame.cover, dry.cover);
  EXPECT_LT(red_at(frame, 0), red_at(dry, 0));
  EXPECT_LT(3 * green_at(frame, 0), red_at(frame, 0));
  EXPECT_EQ(green_at(frame, 7), green_at(dry, 7));
  const auto darker_below = [&](double y_mm) {
    const int y = static_cast<int>(kShadowedSide_px / 2 + 250 * y_mm / kSkin_mm);
    return frame.color.at(kShadowedSide_px / 2, y)[1] < dry.color.at(kShadowedSide_px / 2, y)[1];
  };
  EXPECT_TRUE(darker_below(20));
  EXPECT_FALSE(darker_below(-8));
  // Where the ways down of two beads part, their pools leave no tooth of dry wall between.
  frame = dry;
  std::vector<BloodLine> two = {blood[0], blood[0]};
  two[0].to_mm.x() = two[1].from_mm.x() = 0;
  two[0].down_wall = Eigen::Vector3d(-0.2, 1, 0).normalized();
  two[1].down_wall = Eigen::Vector3d(0.2, 1, 0).normalized();
  draw_blood(two, view, std::nullopt, frame, kept);
  EXPECT_TRUE(darker_below(15));
  frame = dry;
  draw_smoke({{{0, 0, kSkin_mm - 8}, 4, 0.5}}, view, frame, kept);
  EXPECT_EQ(frame.depth_mm, dry.depth_mm);
  EXPECT_EQ(frame.cover, dry.cover);
  EXPECT_NE(green_at(frame, 0), green_at(dry, 0));
  EXPECT_EQ(green_at(frame, 7), green_at(dry, 7));
  frame = dry;
  draw_smoke({{{0, 0, kSkin_mm + 8}, 4, 0.5}}, view, frame, kept);
  EXPECT_EQ(frame.color.pixels, dry.color.pixels);
}

// On the skin, not on the wall below it, whose own way it does not know; and not broken off where
// the next bead leans away.
TEST(Wounds, TheLampShowsInBloodSoftly) {
  Frame frame = wall_of_skin();
  KeptPixels kept;
  const Eigen::Vector3d joint(0, 0, kSkin_mm), way(12, 0, 0);
  const Eigen::Vector3d away = Eigen::Vector3d(1, 0, -1).normalized();
  draw_blood({{joint - way, joint, -Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitY(), 6, 6},
              {joint, joint + way, away, Eigen::Vector3d::UnitY(), 6, 6}},
             straight(), Eigen::Vector3d::Zero(), frame, kept);
  const int middle = kShadowedSide_px / 2, wall = middle + 1;  // half a millimetre down
  int steepest = 0;
  for (int x = middle - 20; x < middle + 20; ++x)
    steepest = std::max(steepest, std::abs(frame.color.at(x + 1, middle - 1)[1] -
                                           frame.color.at(x, middle - 1)[1]));
  const int bright = frame.color.at(middle - 20, middle - 1)[1];
  EXPECT_GT(bright, 150);
  EXPECT_LT(frame.color.at(middle + 20, middle - 1)[1], 60);
  EXPECT_LT(steepest, bright / 2);
  EXPECT_LT(frame.color.at(middle - 20, wall)[1], 60);
}

// From beyond one border to beyond the next, it is drawn as in a picture that holds all of it.
TEST(Wounds, BloodLeadsOutOfThePicture) {
  const Frame dry = wall_of_skin();
  const View view = straight();
  KeptPixels kept;
  const double aside_mm = kSkin_mm * kShadowedSide_px / 250;  // twice as far as the border
  const auto drawn = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    Frame frame = dry;
    const Eigen::Vector3d down = Eigen::Vector3d::UnitZ().cross(to - from).normalized();
    draw_blood({{from, to, -Eigen::Vector3d::UnitZ(), down, 2, 2}}, view, std::nullopt, frame,
               kept);
    return frame.color.pixels;
  };
  const Eigen::Vector3d middle(0, 0, kSkin_mm);
  for (const Eigen::Vector3d& way : {Eigen::Vector3d(aside_mm, 0, 0), {aside_mm, aside_mm, 0}}) {
    std::vector<std::uint8_t> halves = drawn(middle - way, middle);
    const std::vector<std::uint8_t> other = drawn(middle, middle + way),
                                    whole = drawn(middle - way, middle + way);
    EXPECT_NE(whole, dry.color.pixels);
    std::ranges::transform(halves, other, halves.begin(),
                           [](auto a, auto b) { return std::min(a, b); });
    EXPECT_EQ(whole, halves);
  }
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

// Below its rim a dent is the darker and redder the deeper it is; skin at the rim and away from it
// is as it was.
TEST(ToolShadows, ADentIsDarkerTheDeeperItIs) {
  Solid ball;
  ball.radius_mm = 4, ball.from = ball.to = Eigen::Vector3d(0, 0, kSkin_mm - ball.radius_mm);
  const Frame touched = shaded({ball}, {4, -3, 0});
  int last = green_at(touched, 6);
  for (const double depth_mm : {2.0, 5.0, 10.0}) {
    ball.pressed_mm = Eigen::Vector3d(0, 0, depth_mm);
    const Frame pressed = shaded({ball}, {4, -3, 0});
    EXPECT_LT(green_at(pressed, 6), last - 4) << depth_mm << " mm";
    last = green_at(pressed, 6);
    EXPECT_GT(red_at(pressed, 6), last + depth_mm / 2);
    EXPECT_GE(green_at(pressed, 30), 149);
  }
  EXPECT_LT(last, 75);
  // Skin that lies where it lay.
  ball.from.z() = ball.to.z() = kSkin_mm - ball.radius_mm + 10;
  const Frame at_rim = shaded({ball}, {4, -3, 0});
  ball.pressed_mm.setZero();
  EXPECT_EQ(at_rim.color.pixels, shaded({ball}, {4, -3, 0}).color.pixels);
}

// Seen aslant, wet skin shows the rod that stands on it.
TEST(ToolShadows, WetSkinMirrorsWhatTouchesIt) {
  Frame frame = wall_of_skin();
  const View view = straight();
  // A floor that falls away from the eye: 20 mm below it, from 60 mm on.
  for (int y = 0; y < kShadowedSide_px; ++y)
    for (int x = 0; x < kShadowedSide_px; ++x) {
      const double slope = (y + 0.5 - kShadowedSide_px / 2.0) / 250;
      frame.depth_mm[std::size_t(y) * kShadowedSide_px + x] =
          slope > 0.05 ? static_cast<float>(20 / slope) : std::numeric_limits<float>::infinity();
    }
  std::fill(frame.color.pixels.begin(), frame.color.pixels.end(), std::uint8_t{0});
  Solid rod;
  rod.from = Eigen::Vector3d(0, 19, 90);
  rod.to = Eigen::Vector3d(0, -20, 90);
  rod.radius_mm = 2;
  KeptPixels kept;
  shade_skin_by_solids({rod}, view, Eigen::Vector3d(4, -3, 0), frame, kept);
  // The image of the rod's foot lies before it: nearer to the eye.
  int brightest = 0;
  for (int y = kShadowedSide_px / 2 + 56; y < kShadowedSide_px / 2 + 70; ++y)
    brightest = std::max(brightest, int(frame.color.at(kShadowedSide_px / 2, y)[1]));
  EXPECT_GT(brightest, 3);
}

}  // namespace
}  // namespace organbake
