// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "organ_to_play.h"
#include "organbake/core/error.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#include "organbake/warp/paper_warp.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// The organ somewhere else in the world, with its cameras.
Bundle organ_at(const Vector3d& offset_mm) {
  Bundle bundle = organ_to_play();
  for (Vector3d& v : bundle.proxy.vertices) v += offset_mm;
  for (auto& camera : bundle.cameras.cameras) {
    RigidTransform& pose = camera.camera_from_world;
    pose.translation -= pose.rotation * offset_mm;
  }
  bundle.cameras.manifold.center_world_mm += offset_mm;
  return bundle;
}

// One before the other for the eye at camera 0, and beside it.
Vector3d behind_and_beside() {
  const RigidTransform world_from_camera =
      organ_to_play().cameras.cameras[0].camera_from_world.inverse();
  return world_from_camera.rotation * Vector3d(40, 0, 60);
}

View view_of(const Player& player) { return orbit_view(player.bundle().cameras, {}, 160, 120); }

DrawOptions with_depth() {
  DrawOptions options;
  options.keep_depth = true;
  return options;
}

// One sample a pixel.
Frame drawn(Player& player, const View& view) {
  DrawOptions options = with_depth();
  options.smooth_outline = false;
  Frame frame;
  player.draw(view, options, frame);
  return frame;
}

TEST(SeveralOrgans, TheNearerOneHidesTheOther) {
  Player both({organ_to_play(), organ_at(behind_and_beside())});
  Player first(organ_to_play()), second(organ_at(behind_and_beside()));
  const View view = view_of(both);
  const Frame joined = drawn(both, view), a = drawn(first, view), b = drawn(second, view);
  std::size_t of_first = 0, of_second = 0, hidden = 0;
  for (std::size_t i = 0; i < joined.depth_mm.size(); ++i) {
    const bool from_a = !(b.depth_mm[i] < a.depth_mm[i]);
    const Frame& nearer = from_a ? a : b;
    EXPECT_EQ(joined.depth_mm[i], nearer.depth_mm[i]);
    EXPECT_EQ(joined.cover[i], nearer.cover[i]);
    for (std::size_t k = 3 * i; k < 3 * i + 3; ++k)
      EXPECT_EQ(joined.color.pixels[k], nearer.color.pixels[k]);
    of_first += from_a && std::isfinite(a.depth_mm[i]);
    of_second += !from_a;
    hidden += from_a && std::isfinite(b.depth_mm[i]);
  }
  EXPECT_GT(of_first, 100u);
  EXPECT_GT(of_second, 100u);
  EXPECT_GT(hidden, 100u);
}

// Against the background, and where one hides the other: by the share of a pixel that is in front.
TEST(SeveralOrgans, AreSmoothedAgainstBackgroundAndEachOther) {
  Player both({organ_to_play(), organ_at(behind_and_beside())});
  const View view = view_of(both);
  const Frame sharp = drawn(both, view);
  Frame smooth;
  both.draw(view, with_depth(), smooth);
  EXPECT_EQ(smooth.cover, sharp.cover);
  const int width = sharp.color.width;
  constexpr float kApart_mm = 20;  // of the two
  int at_background = 0, at_other = 0;
  for (int y = 1; y + 1 < sharp.color.height; ++y) {
    for (int x = 1; x + 1 < width; ++x) {
      if (std::equal(sharp.color.at(x, y), sharp.color.at(x, y) + 3, smooth.color.at(x, y)))
        continue;
      const auto depth = [&](int dx, int dy) {
        return sharp.depth_mm[std::size_t(y + dy) * width + x + dx];
      };
      bool background = std::isinf(depth(0, 0)), other = false;
      for (const float beside : {depth(-1, 0), depth(1, 0), depth(0, -1), depth(0, 1)}) {
        background |= std::isinf(beside);
        other |= std::isfinite(beside) && std::abs(beside - depth(0, 0)) > kApart_mm;
      }
      at_background += background;
      at_other += other && !background;
    }
  }
  EXPECT_GT(at_background, 100);
  EXPECT_GT(at_other, 10);
}

TEST(SeveralOrgans, AnUnchangedFrameIsLeftAloneAndAChangedOneIsNot) {
  Player both({organ_to_play(), organ_at(behind_and_beside())});
  const View view = view_of(both);
  Frame frame;
  EXPECT_FALSE(both.draw(view, {}, frame).unchanged);
  EXPECT_TRUE(frame.depth_mm.empty());
  EXPECT_TRUE(both.draw(view, {}, frame).unchanged);
  EXPECT_FALSE(both.draw(view, with_depth(), frame).unchanged);  // lacked its depth
  EXPECT_FALSE(frame.depth_mm.empty());
  Frame other;
  EXPECT_FALSE(both.draw(view, with_depth(), other).unchanged);  // holds nothing yet
  EXPECT_EQ(other.color.pixels, frame.color.pixels);
}

// A tool presses the first from the other side until it leans on the second.
TEST(SeveralOrgans, APokeReachesTheNeighbour) {
  const Bounds box = bounds(organ_to_play().proxy);
  const Vector3d beside((box.max - box.min).x() + 1, 0, 0);
  Player both({organ_to_play(), organ_at(beside)});
  const std::vector<Vector3d> rest = both.proxy_positions(1);
  StepReport report;
  for (int step = 0; step <= 80; ++step) {
    const Vector3d at(box.min.x() - 6 + 0.5 * step, box.center().y(), box.center().z());
    report = both.step({{at, 6, Ball{}, true, Vector3d::Zero()}});
  }
  EXPECT_GT(report.tissue_contacts, 0u);
  EXPECT_NE(both.proxy_positions(1), rest);
  both.reset();
  EXPECT_EQ(both.proxy_positions(1), rest);
}

TEST(SeveralOrgans, ThePapersWarpIsForOne) {
  Player both({organ_to_play(), organ_at(behind_and_beside())}, {}, true);
  both.draw_by(std::make_shared<PaperDrawing>(both.bundle()));
  Frame frame;
  EXPECT_THROW(both.draw(view_of(both), {}, frame), UsageError);
  EXPECT_THROW(Player(std::vector<Bundle>{}), UsageError);
}

}  // namespace
}  // namespace organbake
