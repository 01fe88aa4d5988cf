// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/phantom/moving_clip.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "tissue_of_tests.h"

namespace organbake {
namespace {

MovingClipOptions small_clip(ScopePath path) {
  MovingClipOptions options;
  options.view = {.width = 160, .height = 90, .frames = 60, .noise = 0};
  options.path = path;
  return options;
}

// One relief takes seconds: clips that differ in their scope alone share the seed, not the object.
const MovingClip& tour() {
  static const MovingClip clip([] {
    MovingClipOptions options = small_clip(ScopePath::tour);
    options.breathing_mm = 3;
    options.breathing_period_s = 2;
    options.blurred = 0.1;
    return options;
  }());
  return clip;
}

TEST(MovingClipOptions, DefaultsAreValidAndBoundsAreKept) {
  EXPECT_NO_THROW(MovingClipOptions().check());
  const auto refused = [](auto change) {
    MovingClipOptions options;
    change(options);
    EXPECT_THROW(options.check(), UsageError);
  };
  refused([](auto& o) { o.breathing_mm = -1; });
  refused([](auto& o) { o.breathing_mm = 21; });
  refused([](auto& o) { o.breathing_period_s = 0.5; });
  refused([](auto& o) { o.blurred = 1.1; });
  refused([](auto& o) { o.blurred = std::nan(""); });
  refused([](auto& o) { o.view.baseline_mm = 4; });
  refused([](auto& o) { o.view.tilt_rad = 0.3; });
  refused([](auto& o) { o.view.width = 2; });
}

// Every pixel's depth lies on the surface as the breath has it, and nothing lies before it.
TEST(MovingClip, DepthIsTheSurfacesAsTheBreathHasMovedIt) {
  for (const int index : {0, 20, 33}) {
    const LaparoscopyFrame frame = tour().frame(index);
    const RigidTransform world_from_camera = frame.camera.camera_from_world.inverse();
    int seen = 0, off = 0;
    for (int y = 0; y < 90; ++y)
      for (int x = 0; x < 160; ++x) {
        const float depth = frame.depth_mm.at(x, y);
        if (!std::isfinite(depth)) continue;
        const Eigen::Vector3d point =
            world_from_camera *
            Eigen::Vector3d(depth * unproject(frame.camera.intrinsics, {x + 0.5, y + 0.5}));
        const double surface =
            relief().at(point.x(), point.y(), tour().breath_mm(index)).height.z_mm;
        ++seen;
        off += std::abs(surface - point.z()) > 1e-3;
        EXPECT_GT(depth, 25);
        EXPECT_LT(depth, 95);
      }
    EXPECT_GT(seen, 0.6 * 160 * 90);
    EXPECT_LT(off, 0.002 * seen);  // where rays graze the surface
  }
}

TEST(MovingClip, BreathsRestAndReachTheirExcursion) {
  EXPECT_EQ(tour().breath_mm(0), 0);
  EXPECT_NEAR(tour().breath_mm(25), 3, 1e-9);  // 1 s of a period of 2
  EXPECT_LT(tour().breath_mm(8), 0.3);         // sin⁴ rests long
}

TEST(MovingClip, AShareOfTheFramesIsBlurred) {
  int blurred = 0;
  for (int i = 0; i < 60; ++i) {
    blurred += tour().blur_px(i) > 0;
    if (tour().blur_px(i) > 0) {
      EXPECT_GE(tour().blur_px(i), 6 * 160 / 1280.0);
      EXPECT_LE(tour().blur_px(i), 18 * 160 / 1280.0);
    }
  }
  EXPECT_EQ(blurred, 6);
}

TEST(MovingClip, TheInstrumentCrossesInTheMiddle) {
  const auto hidden = [](const LaparoscopyFrame& frame) {
    int count = 0;
    for (std::size_t k = 0; k < frame.instrument.size(); ++k) {
      count += frame.instrument.values[k];
      EXPECT_TRUE(!frame.instrument.values[k] || std::isinf(frame.depth_mm.values[k]));
    }
    return count;
  };
  EXPECT_EQ(hidden(tour().frame(3)), 0);
  EXPECT_GT(hidden(tour().frame(30)), 0.03 * 160 * 90);
  EXPECT_LT(hidden(tour().frame(30)), 0.3 * 160 * 90);
  EXPECT_EQ(hidden(tour().frame(56)), 0);
}

TEST(MovingClip, TheSameBytesOnOneThread) {
  const Rgb8Image many = tour().frame(20).image;
  const ThreadLimit one(1);
  EXPECT_EQ(tour().frame(20).image.pixels, many.pixels);
}

TEST(MovingClip, AStillScopeSeesOneFrameAndAZoomItsMiddleLarger) {
  MovingClipOptions options = small_clip(ScopePath::still);
  options.view.instrument = false;
  const MovingClip still(options);
  EXPECT_EQ(still.frame(0).image.pixels, still.frame(40).image.pixels);
  options.path = ScopePath::zoom;
  const MovingClip zoom(options);
  EXPECT_EQ(zoom.frame(0).image.pixels, still.frame(0).image.pixels);
  EXPECT_GT(zoom.camera(59).intrinsics.fx, 1.7 * zoom.camera(0).intrinsics.fx);
  EXPECT_EQ(zoom.camera(59).name, "frame_000059");
}

TEST(MovingClip, TheSurfaceIsWiderThanAFrameSees) {
  const TriangleMesh mesh = tour().surface();
  EXPECT_EQ(mesh.colors.size(), mesh.vertices.size());
  const Bounds box = bounds(mesh);
  EXPECT_GT(box.max.x() - box.min.x(), 180);
  EXPECT_GT(box.max.y() - box.min.y(), 120);
}

}  // namespace
}  // namespace organbake
