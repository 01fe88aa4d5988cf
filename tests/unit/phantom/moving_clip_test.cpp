// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/phantom/laparoscopy.h"

#include "formulas.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"
#include "support/testing.h"

namespace organbake {
namespace {

// Of seed 1, as clips have it by default; made once.
const TissueRelief& relief() {
  static const TissueRelief relief(1);
  return relief;
}

// The point of the surface at rest that a breath has brought to x, y.
Eigen::Vector3d rest_point(double x, double y, double excursion) {
  const TissueRelief::Breathed moved = relief().at(x, y, excursion);
  return {moved.rest_x_mm, moved.rest_y_mm, relief().at(moved.rest_x_mm, moved.rest_y_mm).z_mm};
}

TEST(TissueRelief, SlopesAreTheHeightsOwn) {
  constexpr double kStep = 1e-3;
  for (const double excursion : {0.0, 3.0, 12.0})
    for (double x = -50.1; x < 60; x += 7.3)
      for (double y = -40.2; y < 40; y += 6.1) {
        const auto z = [&](double dx, double dy) {
          return relief().at(x + dx, y + dy, excursion).height.z_mm;
        };
        const TissueRelief::Height here = relief().at(x, y, excursion).height;
        // Float nodes carry 4e-6 mm, and the step has its share of curvature.
        EXPECT_NEAR(here.slope_x, (z(kStep, 0) - z(-kStep, 0)) / (2 * kStep), 1e-3);
        EXPECT_NEAR(here.slope_y, (z(0, kStep) - z(0, -kStep)) / (2 * kStep), 1e-3);
      }
}

TEST(TissueRelief, ABreathPushesTheLiverFartherThanTheFat) {
  constexpr double kExcursion = 3;
  const auto pushed = [&](double x, double y) {
    const double now = relief().at(x, y, kExcursion).height.z_mm;
    return (Eigen::Vector3d(x, y, now) - rest_point(x, y, kExcursion)).norm();
  };
  EXPECT_NEAR(pushed(-20, -45), kExcursion, 1e-6);
  EXPECT_NEAR(pushed(-20, 60), 0.35 * kExcursion, 1e-6);
  EXPECT_LT(pushed(-20, 20), pushed(-20, 0));
  EXPECT_EQ(rest_point(10, 10, 0), Eigen::Vector3d(10, 10, relief().at(10, 10).z_mm));
}

TEST(TissueRelief, TissuesAddUpAndAllThreeAreThere) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (double x = -50; x <= 50; x += 1)
    for (double y = -35; y <= 35; y += 1) {
      const Eigen::Vector3d share = relief().tissues(x, y);
      EXPECT_NEAR(share.sum(), 1, 1e-12);
      EXPECT_GE(share.minCoeff(), 0);
      sum += share;
    }
  EXPECT_GT(sum.minCoeff(), 0.03 * sum.sum());
}

TEST(TissueRelief, TheMeshLiesOnItAndLooksAtTheScope) {
  const TriangleMesh mesh = relief().surface(2);
  for (std::size_t i = 0; i < mesh.vertices.size(); i += 97) {
    const Eigen::Vector3d& v = mesh.vertices[i];
    EXPECT_EQ(v.z(), relief().at(v.x(), v.y()).z_mm);
  }
  for (std::size_t f = 0; f < mesh.faces.size(); f += 53) EXPECT_LT(face_normal(mesh, f).z(), 0);
}

const TissueSkin& mottled() {
  static const TissueSkin skin(relief(), 1, 0.1);
  return skin;
}

// Standard deviation of the logarithm of red along rows of liver, of differences so far apart.
double contrast(const TissueSkin& skin, double apart_mm) {
  double squares = 0, count = 0;
  for (double y = -30; y < -18; y += 0.31)
    for (double x = -45; x < -10; x += 0.17, ++count)
      squares +=
          std::pow(std::log(skin.at(x + apart_mm, y).albedo.x() / skin.at(x, y).albedo.x()), 2);
  return std::sqrt(squares / count / 2);
}

TEST(TissueSkin, IsMottledAtAllSizes) {
  const TissueSkin& skin = mottled();
  EXPECT_GT(contrast(skin, 0.3), 0.03);
  EXPECT_GT(contrast(skin, 1), 1.2 * contrast(skin, 0.3));
  EXPECT_GT(contrast(skin, 5), 1.1 * contrast(skin, 1));
  EXPECT_LT(contrast(skin, 5), 0.3);
}

TEST(TissueSkin, WithoutMottlingATissueIsOfOneColour) {
  const TissueSkin skin(relief(), 1, 0);
  EXPECT_LT(contrast(skin, 5), 1e-3);
}

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

TEST(MovingClipOptions, APathHasOneEyeAndItsOwnViews) {
  EXPECT_NO_THROW(MovingClipOptions().check());
  EXPECT_THROW(MovingClipOptions{.view = {.baseline_mm = 4}}.check(), UsageError);
  EXPECT_THROW(MovingClipOptions{.view = {.tilt_rad = 0.3}}.check(), UsageError);
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

constexpr ScopePath kAll[] = {ScopePath::still, ScopePath::slide, ScopePath::approach,
                              ScopePath::turn,  ScopePath::orbit, ScopePath::tour,
                              ScopePath::zoom};

Eigen::Vector3d center(ScopePath path, double share) {
  return scope_pose(path, share).camera_from_world.inverse().translation;
}

double turned_rad(ScopePath path, double from, double to) {
  const Eigen::Matrix3d turn = scope_pose(path, to).camera_from_world.rotation *
                               scope_pose(path, from).camera_from_world.rotation.transpose();
  return Eigen::AngleAxisd(turn).angle();
}

TEST(ScopePath, PosesAreRigidAndSmooth) {
  constexpr int kSteps = 120;
  for (const ScopePath path : kAll)
    for (int i = 0; i < kSteps; ++i) {
      const double share = double(i) / kSteps, next = double(i + 1) / kSteps;
      EXPECT_TRUE(is_rotation(scope_pose(path, share).camera_from_world.rotation, 1e-9));
      // A hand moves less than this from frame to frame.
      EXPECT_LT((center(path, next) - center(path, share)).norm(), 3.0);
      EXPECT_LT(turned_rad(path, share, next), 0.06);
    }
}

TEST(ScopePath, WhatHasNoParallaxStaysWhereItIs) {
  for (const ScopePath path : {ScopePath::still, ScopePath::turn, ScopePath::zoom})
    for (const double share : {0.1, 0.5, 0.9, 1.0}) EXPECT_EQ(center(path, share), center(path, 0));
  EXPECT_EQ(turned_rad(ScopePath::still, 0, 0.7), 0);
  EXPECT_GT(turned_rad(ScopePath::turn, 0, 0.25), 0.2);
  EXPECT_EQ(scope_pose(ScopePath::zoom, 0).zoom, 1);
  EXPECT_GT(scope_pose(ScopePath::zoom, 1).zoom, 1.5);
  EXPECT_EQ(scope_pose(ScopePath::tour, 1).zoom, 1);
}

TEST(ScopePath, LoopsCloseAndTheOthersTravel) {
  for (const ScopePath path : {ScopePath::orbit, ScopePath::tour}) {
    EXPECT_LT((center(path, 1) - center(path, 0)).norm(), 0.5);
    EXPECT_LT(turned_rad(path, 0, 1), 0.02);
    EXPECT_GT((center(path, 0.4) - center(path, 0)).norm(), 20);
  }
  EXPECT_GT((center(ScopePath::slide, 1) - center(ScopePath::slide, 0)).x(), 50);
  EXPECT_GT((center(ScopePath::approach, 1) - center(ScopePath::approach, 0)).z(), 35);
}

constexpr int kWidth = 101, kHeight = 61;

SensorLight spot_of_light() {
  SensorLight light(kWidth, kHeight);
  light.radiance[30 * kWidth + 50].setConstant(1);
  return light;
}

Intrinsics lens() { return {kWidth, kHeight, 80, 80, kWidth / 2.0, kHeight / 2.0}; }

// A turn about y moves what is seen along x.
TEST(ScopeExposure, ATurnLeavesATrailOfItsLength) {
  constexpr double kTrail_px = 10;
  const SensorLight blurred = blurred_by_turn(spot_of_light(), lens(), {0, kTrail_px / 80});
  double sum = 0, mean = 0, spread = 0;
  for (int x = 0; x < kWidth; ++x) {
    const double value = blurred.radiance[30 * kWidth + x][0];
    sum += value;
    mean += value * x;
    spread += value * (x - 50.0) * (x - 50.0);
  }
  EXPECT_NEAR(sum, 1, 0.02);  // no light is lost; the trail bends by next to nothing
  EXPECT_NEAR(mean / sum, 50, 0.05);
  EXPECT_NEAR(std::sqrt(12 * spread / sum), kTrail_px, 0.5);  // an even trail's length
  EXPECT_LT(blurred.radiance[34 * kWidth + 50][0], 1e-6);
}

TEST(ScopeExposure, EncodesAsSrgbWithNoiseOfItsDeviation) {
  SensorLight light(400, 300);
  for (auto& value : light.radiance) value = {0.5f, 0.2f, 0.02f};
  const Rgb8Image image = exposed(light, {.noise = 0.02});
  for (int c = 0; c < 3; ++c) {
    double sum = 0, squares = 0, count = 0;
    for (int y = 140; y < 160; ++y)
      for (int x = 190; x < 210; ++x, ++count) {
        sum += image.at(x, y)[c];
        squares += image.at(x, y)[c] * image.at(x, y)[c];
      }
    const double mean = sum / count;
    const double wanted = 255 * srgb_from_linear(light.radiance[0][c]);
    EXPECT_NEAR(mean, wanted, 1);  // 400 pixels of 5.1 grey levels of noise
    EXPECT_NEAR(std::sqrt(squares / count - mean * mean), 5.1, 0.8);
  }
}

TEST(ScopeExposure, TheStopIsBlack) {
  SensorLight light(kWidth, kHeight);
  for (auto& value : light.radiance) value.setConstant(0.5f);
  const ScopeSensor sensor{.noise = 0, .stop_radius_px = 20};
  const Rgb8Image image = exposed(light, sensor);
  EXPECT_EQ(image.at(50 + 21, 30)[0], 0);
  EXPECT_GT(image.at(50 + 19, 30)[0], 100);
}

}  // namespace
}  // namespace organbake
