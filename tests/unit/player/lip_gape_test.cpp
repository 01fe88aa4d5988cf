// SPDX-License-Identifier: Apache-2.0
#include "organbake/cutting/cut_skin.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "organbake/core/random.h"
#include "organs_to_play.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kHalf_mm = 15, kDeep_mm = 12;

// A blade that is drawn across the front, 30 mm along x.
Instrument blade_in_front(double share) {
  const SyntheticOrgan& organ = organ_options().organ;
  Instrument tip;
  tip.active = true;
  tip.kind = Blade{};
  tip.radius_mm = 0.4;
  tip.axis_mm = Vector3d(0, -30, 0);
  tip.position_mm = organ.center + Vector3d(kHalf_mm * (2 * share - 1), 0, 4);
  tip.position_mm.y() -= organ.radius({0, -1, 0}) - kDeep_mm;
  return tip;
}

// Where the cut runs on the skin, by the organ's formula.
Vector3d on_skin(double share) {
  const Vector3d tip = blade_in_front(share).position_mm, outside = tip - Vector3d(0, 100, 0);
  return outside + organ_options().organ.trace(outside, {0, 1, 0}) * Vector3d(0, 1, 0);
}

Player& cut_in_front() {
  static Player player = [] {
    Player made(organ_to_cut(), with_fem());
    for (int i = 0; i <= 30; ++i) made.step({blade_in_front(i / 30.0)});
    let_part(made);
    return made;
  }();
  return player;
}

double brightness(const Frame& frame, const Eigen::Vector2d& px) {
  const int x = static_cast<int>(px.x()), y = static_cast<int>(px.y());
  if (x < 0 || y < 0 || x >= frame.color.width || y >= frame.color.height) return 0;
  const std::uint8_t* rgb = frame.color.at(x, y);
  return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

// Of the darkest place within the gape about a place of the cut to the skin on both its sides.
double contrast_at(const Frame& frame, const View& view, double share) {
  const Vector3d at = on_skin(share), aside(0, 0, 1);
  const auto seen = [&](double mm) {
    return brightness(frame, project(view.camera, at + mm * aside));
  };
  double line = 255, skin = 0;
  for (double mm = -1; mm <= 1; mm += 0.05) line = std::min(line, seen(mm));
  int places = 0;
  for (double mm = 2.5; mm <= 5; mm += 0.25) skin += seen(mm) + seen(-mm), places += 2;
  return 1 - line / (skin / places);
}

// From 50 to 120 mm, up to 35° from straight above, turned in any way.
View view_of_cut(RandomStream& random) {
  const double slant = random.uniform(0, 35) * std::numbers::pi / 180,
               turn = random.uniform(0, 2 * std::numbers::pi);
  const Vector3d to_eye(std::sin(slant) * std::cos(turn), -std::cos(slant),
                        std::sin(slant) * std::sin(turn));
  const Vector3d middle = on_skin(0.5), up = {random.uniform(-1, 1), 0, random.uniform(0.1, 1)};
  View view;
  view.camera.camera_from_world = look_at(middle + random.uniform(50, 120) * to_eye, middle, up);
  view.camera.intrinsics = {640, 480, 620, 620, 320, 240};
  return view;
}

TEST(LipGape, ACutAtRestShowsInTwentyOfTwentyViews) {
  Player& player = cut_in_front();
  ASSERT_TRUE(player.is_cut());
  RandomStream random(5);
  std::vector<double> shares;  // of the cut, by view
  for (int i = 0; i < 20; ++i) {
    const View view = view_of_cut(random);
    Frame frame;
    player.draw(view, {}, frame);
    int dark = 0, places = 0;
    double least = 1;
    for (double share = 0.02; share < 0.98; share += 0.01, ++places) {
      const double contrast = contrast_at(frame, view, share);
      dark += contrast >= 0.3;
      if (share > 0.05 && share < 0.95) least = std::min(least, contrast);
    }
    std::printf("view %d: %.1f %% of the cut with contrast 0.3, least %.2f\n", i,
                100.0 * dark / places, least);
    shares.push_back(double(dark) / places);
  }
  EXPECT_GE(*std::min_element(shares.begin(), shares.end()), 0.95);
}

// Between lips, far from the cut's ends: what the pose that is drawn adds to the tissue's own.
TEST(LipGape, GapesAsWideAsASkinsTensionPullsAndMovesNoTissue) {
  Player& player = cut_in_front();
  std::vector<Vector3d> drawn = player.proxy_positions();
  const std::vector<Vector3d> tissue = drawn;
  ASSERT_TRUE(player.gape());
  player.gape()->open(drawn);
  EXPECT_EQ(player.proxy_positions(), tissue);
  const Vector3d middle = on_skin(0.5);
  double below = 0, above = 0, farthest = 0;
  for (std::size_t v = 0; v < drawn.size(); ++v) {
    const Vector3d moved = drawn[v] - tissue[v];
    farthest = std::max(farthest, moved.norm());
    if (std::abs((tissue[v] - middle).x()) > 8 || (tissue[v] - middle).norm() > 10) continue;
    below = std::min(below, moved.z()), above = std::max(above, moved.z());
  }
  EXPECT_GE(above - below, 0.5);
  EXPECT_LE(above - below, 2);
  EXPECT_LE(farthest, 0.5 * organ_to_cut().mechanics.cut_gape_mm + 1e-9);
}

}  // namespace
}  // namespace organbake
