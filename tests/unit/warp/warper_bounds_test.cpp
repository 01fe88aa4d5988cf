// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/warp/camera_shares.h"
#include "organbake/warp/warper.h"
#include "support/synthetic_bundle.h"
#include "unit/warp/views_round.h"

namespace organbake {
namespace {

const Bundle& bounds_organ() {
  static const Bundle bundle = make_synthetic_bundle({.organ = {}, .map_size = 64});
  return bundle;
}

View front(int width, int height, double away = 1) {
  return view_round(bounds_organ().cameras, 0.3, 0.2, away, width, height);
}

DrawReport draw(const View& view, Frame& frame) {
  return Warper(bounds_organ()).draw(bounds_organ().proxy.vertices, view, {}, frame);
}

TEST(WarperBounds, AnyPictureSizeWorks) {
  for (const auto& [width, height] :
       {std::pair{1, 1}, {1, 300}, {7, 5}, {129, 127}, {3840, 2160}}) {
    Frame frame;
    const DrawReport report = draw(front(width, height), frame);
    EXPECT_EQ(frame.color.pixels.size(), std::size_t(3) * width * height);
    EXPECT_EQ(frame.cover.size(), std::size_t(width) * height);
    EXPECT_EQ(report.holes_after, 0u) << width << " × " << height;
  }
}

TEST(WarperBounds, AnEyeAtTheSkinInsideAndAtTheCentreIsHarmless) {
  for (const double away : {0.3, 0.2, 0.1, 0.02, 1e-9, 0.0}) {
    Frame frame;
    EXPECT_NO_THROW(draw(front(160, 120, away), frame)) << away;
    EXPECT_EQ(frame.cover.size(), 160u * 120u);
  }
}

// A texel's patch goes on as a plane as far as the next texel, and so may run behind an eye that is
// nearer than that to the skin.
TEST(WarperBounds, NothingIsSeenBehindAnEyeInTheSkin) {
  Warper warper(bounds_organ());
  RandomStream random(1);
  Frame frame;
  std::size_t covered = 0;
  for (int i = 0; i < 300; ++i) {
    View view = front(48, 48);
    view.near_mm = 1e-3;
    const std::size_t v = random.below(bounds_organ().proxy.vertices.size());
    const Eigen::Vector3d eye = bounds_organ().proxy.vertices[v] * random.uniform(0.95, 1.05);
    const Eigen::Vector3d aside(random.normal(), random.normal(), random.normal());
    view.camera.camera_from_world = look_at(eye, eye + aside, Eigen::Vector3d::UnitZ());
    DrawOptions options;
    options.keep_depth = true;
    warper.draw(bounds_organ().proxy.vertices, view, options, frame);
    for (const float depth : frame.depth_mm) {
      ASSERT_GT(depth, 0) << "view " << i;
      covered += std::isfinite(depth);
    }
  }
  EXPECT_GT(covered, 1000u);
}

TEST(WarperBounds, EverySampleIsDrawnOrCountedAsSkipped) {
  Warper warper(bounds_organ());
  const auto total = [](const DrawReport& r) {
    return r.samples_drawn + r.samples_facing_away + r.samples_outside_view;
  };
  Frame frame;
  const DrawReport seen = warper.draw(bounds_organ().proxy.vertices, front(200, 150), {}, frame);
  EXPECT_GT(seen.samples_drawn, 0u);
  EXPECT_GT(seen.samples_facing_away, 0u);
  EXPECT_EQ(seen.samples_outside_view, 0u);
  View aside = front(200, 150);
  aside.camera.intrinsics.cx = 1e5;  // looks past the organ
  const DrawReport missed = warper.draw(bounds_organ().proxy.vertices, aside, {}, frame);
  EXPECT_EQ(missed.samples_drawn, 0u);
  EXPECT_EQ(missed.sample_pixels + missed.base_pixels, 0u);
  EXPECT_EQ(total(missed), total(seen));
  EXPECT_EQ(missed.faces_drawn, 0u);
}

TEST(WarperBounds, BadViewsAreRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<View> bad(6, front(64, 64));
  bad[0].camera.intrinsics.k1 = 0.1;
  bad[1].camera.intrinsics.width = 0;
  bad[2].camera.intrinsics.height = 20000;
  bad[3].camera.intrinsics.fx = nan;
  bad[4].camera.camera_from_world.translation.x() = nan;
  bad[5].near_mm = 0;
  for (const View& view : bad) {
    Frame frame;
    EXPECT_THROW(draw(view, frame), UsageError);
  }
}

TEST(WarperBounds, BadPositionsAreRefusedAndTheNextFrameIsFine) {
  Warper warper(bounds_organ());
  Frame frame;
  auto positions = bounds_organ().proxy.vertices;
  positions[5].z() = std::numeric_limits<double>::infinity();
  EXPECT_THROW(warper.draw(positions, front(64, 64), {}, frame), BadDataError);
  positions.pop_back();
  EXPECT_THROW(warper.draw(positions, front(64, 64), {}, frame), BadDataError);
  EXPECT_GT(warper.draw(bounds_organ().proxy.vertices, front(64, 64), {}, frame).sample_pixels, 0u);
}

TEST(WarperBounds, CollapsedAndInvertedProxiesDoNotCrash) {
  Warper warper(bounds_organ());
  Frame frame;
  std::vector<Eigen::Vector3d> point(bounds_organ().proxy.vertices.size(),
                                     Eigen::Vector3d(10, -20, 30));
  EXPECT_NO_THROW(warper.draw(point, front(128, 128), {}, frame));
  auto inverted = bounds_organ().proxy.vertices;
  for (auto& v : inverted) v = 2 * Eigen::Vector3d(10, -20, 30) - v;
  EXPECT_NO_THROW(warper.draw(inverted, front(128, 128), {}, frame));
  auto far = bounds_organ().proxy.vertices;
  for (auto& v : far) v *= 1e12;
  EXPECT_NO_THROW(warper.draw(far, front(128, 128), {}, frame));
}

TEST(WarperBounds, MapsThatDoNotFitAreRefused) {
  Bundle bundle = bounds_organ();
  bundle.maps[2].depth_mm.pop_back();
  EXPECT_THROW(Warper{bundle}, BadDataError);
  bundle = bounds_organ();
  bundle.maps.pop_back();
  EXPECT_THROW(Warper{bundle}, BadDataError);
  bundle = bounds_organ();
  for (auto& face : bundle.maps[0].face) {
    if (face != kNoFace) face = 1000;
  }
  EXPECT_THROW(Warper{bundle}, BadDataError);
  bundle = bounds_organ();
  bundle.base.color.pop_back();
  EXPECT_THROW(Warper{bundle}, BadDataError);
}

TEST(WarperBounds, AnOrganNobodySawDrawsBackground) {
  Bundle bundle = bounds_organ();
  for (CameraMaps& maps : bundle.maps) std::fill(maps.face.begin(), maps.face.end(), kNoFace);
  bundle.base = {};
  Frame frame;
  const DrawReport report = Warper(bundle).draw(bundle.proxy.vertices, front(64, 64), {}, frame);
  EXPECT_EQ(report.samples_drawn, 0u);
  for (const Cover cover : frame.cover) ASSERT_EQ(cover, Cover::background);
}

TEST(WarperBounds, SharesStayContinuousWhenSmallOnesAreDropped) {
  const ViewWeights just_above = trimmed({{0, 1, 2}, {0.5, 0.49 - 1e-9, 0.01 + 1e-9}});
  const ViewWeights just_below = trimmed({{0, 1, 2}, {0.5, 0.49 + 1e-9, 0.01 - 1e-9}});
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(just_above.weights[i], just_below.weights[i], 1e-7);
  EXPECT_EQ(just_below.weights[2], 0);
  const ViewWeights w = trimmed({{0, 1, 2}, {0.2, 0.3, 0.5}});
  EXPECT_NEAR(w.weights[0] + w.weights[1] + w.weights[2], 1, 1e-12);
}

}  // namespace
}  // namespace organbake
