// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "organbake/capture/camera_rays.h"
#include "unit/capture/scenes.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

TEST(Confidence, FollowsIncidenceAndFadesAtTheOutline) {
  constexpr double kRadius = 30;
  const PosedCamera camera = plain_camera({0, -150, 0}, Vector3d::Zero(), 200);
  const CameraMaps maps = capture(sphere_mesh(kRadius, 6), sphere_mesh(kRadius, 1), {camera},
                                  *make_material_color({}), {})
                              .maps[0];
  const CameraRays rays(camera);
  double outline = 0;
  int outline_texels = 0;
  for (int y = 0; y < 200; ++y)
    for (int x = 0; x < 200; ++x) {
      const int p = y * 200 + x;
      const float confidence = maps.confidence[p];
      ASSERT_GE(confidence, 0);
      ASSERT_LE(confidence, 1);
      if (std::isinf(maps.depth_mm[p])) continue;
      const Ray ray = rays.through(x + 0.5, y + 0.5);
      const Vector3d normal = (ray.origin + double(maps.depth_mm[p]) * ray.direction).normalized();
      const double degrees =
          std::acos(-normal.dot(ray.direction.normalized())) * 180 / 3.14159265358979;
      if (degrees < 58) {
        EXPECT_FLOAT_EQ(confidence, 1);
      }
      EXPECT_LT(degrees, 82) << "kept without confidence";
      EXPECT_GT(confidence, 0);
      if (degrees > 66 && degrees < 69) {
        EXPECT_GT(confidence, 0.1);
        EXPECT_LT(confidence, 0.9);
      }
      if (x > 0 && std::isinf(maps.depth_mm[p - 1])) {
        outline += confidence;
        ++outline_texels;
      }
    }
  ASSERT_GT(outline_texels, 50);
  EXPECT_LT(outline / outline_texels, 0.04);
}

// As data-schemas/bundle-format.md says: of a ball's outline cos² 80° stays empty, so far away.
TEST(Confidence, IsMissingFromThreePercentOfABall) {
  constexpr double kRadius = 30, kDistance = 600, kDegree = 3.14159265358979 / 180;
  const CaptureResult captured = capture(sphere_mesh(kRadius, 6), sphere_mesh(kRadius, 2),
                                         {plain_camera({0, -kDistance, 0}, Vector3d::Zero(), 2000)},
                                         *make_material_color({}), {});
  const auto kept = double(captured.bound_in_prism + captured.bound_by_fallback);
  const double empty = double(captured.unsure_texels) / (kept + double(captured.unsure_texels));
  EXPECT_EQ(captured.back_face_texels + captured.unbound_texels, 0u);
  EXPECT_NEAR(empty, std::pow(std::cos(80 * kDegree), 2), 0.002);
}

// A cross-fade shows every jump of the weights.
TEST(Confidence, HasNoJumps) {
  const CameraMaps maps =
      capture(lumpy_mesh(30, 6), lumpy_mesh(30, 1), {plain_camera({0, -150, 0}, {0, 0, 0}, 200)},
              *make_material_color({}), {})
          .maps[0];
  double largest = 0;
  for (int y = 0; y < 200; ++y)
    for (int x = 1; x < 200; ++x)
      largest = std::max<double>(
          largest, std::abs(maps.confidence[y * 200 + x] - maps.confidence[y * 200 + x - 1]));
  EXPECT_LT(largest, 0.6);  // three texels from 0 to 1, at their steepest
}

// A disc before a wall: both fade towards the disc's outline, which lies inside the picture.
TEST(Confidence, FadesOnBothSidesOfAnInnerOutline) {
  const TriangleMesh wall = square_at({0, 40, 0}, {0, -1, 0}, 200, 4);
  const TriangleMesh both = joined(wall, square_at({0, 0, 0}, {0, -1, 0}, 10, 2));
  const CameraMaps maps = capture(both, both, {plain_camera({0, -100, 0}, {0, 0, 0}, 120)},
                                  *make_material_color({}), {})
                              .maps[0];
  int edges = 0;
  for (int y = 10; y < 110; ++y)
    for (int x = 10; x < 110; ++x) {
      const int p = y * 120 + x;
      const bool edge = std::abs(maps.depth_mm[p] - maps.depth_mm[p + 1]) > 20;
      if (!edge) continue;
      ++edges;
      EXPECT_LT(maps.confidence[p], 0.1);
      EXPECT_LT(maps.confidence[p + 1], 0.1);
      EXPECT_FLOAT_EQ(maps.confidence[p - 8] > maps.confidence[p + 9] ? maps.confidence[p - 8]
                                                                      : maps.confidence[p + 9],
                      1);
    }
  EXPECT_GT(edges, 20);
}

}  // namespace
}  // namespace organbake
