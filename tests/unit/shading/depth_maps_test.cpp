// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/depth_maps.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "known_depth.h"
#include "organbake/core/random.h"

namespace organbake {
namespace {

TEST(DepthMaps, NormalsAreThoseOfDifferencesOfPoints) {
  const NearScene scene = near_scene(1, 128);
  const RayGrid rays = ray_grid(scene.camera);
  const auto point = [&](int x, int y) -> Eigen::Vector3d {
    return std::exp(double(scene.log_range.at(x, y))) *
           Eigen::Vector3d(rays.x(x), rays.y(y), 1).normalized();
  };
  for (int y = 2; y < 126; y += 9)
    for (int x = 2; x < 126; x += 7) {
      const Eigen::Vector3d along = point(x + 1, y) - point(x - 1, y);
      const Eigen::Vector3d down = point(x, y + 1) - point(x, y - 1);
      const Eigen::Vector3d normal = down.cross(along).normalized();
      // Differences over two pixels against fourth order: h² of a curved surface.
      EXPECT_LT((normal - normal_at(scene.log_range, rays, x, y)).norm(), 0.02);
    }
}

TEST(DepthMaps, DepthIsPlanarAndInfiniteOutside) {
  const NearScene scene = near_scene(0.25, 32);
  Mask inside(32, 32, 1);
  inside.at(3, 4) = 0;
  const RayGrid rays = ray_grid(scene.camera);
  const Plane depth = depth_from_log_range(scene.log_range, rays, inside);
  EXPECT_TRUE(std::isinf(depth.at(3, 4)));
  const double range = std::exp(double(scene.log_range.at(30, 2)));
  EXPECT_NEAR(depth.at(30, 2) * std::hypot(1, rays.x(30), rays.y(2)), range, 1e-3);
}

// Half a percent of noise from pixel to pixel turns differences of neighbours by tens of degrees.
TEST(DepthMaps, NormalsOfNoisyDepthAreThePlanes) {
  const Intrinsics camera = near_scene(1, 128).camera;
  const RayGrid rays = ray_grid(camera);
  const Eigen::Vector3d normal = Eigen::Vector3d(0.3, -0.2, -1).normalized();
  Plane depth(128, 128);
  RandomStream random(5);
  for (int y = 0; y < 128; ++y)
    for (int x = 0; x < 128; ++x) {
      const double z = 60 * normal.z() / normal.dot(Eigen::Vector3d(rays.x(x), rays.y(y), 1));
      depth.at(x, y) = static_cast<float>(z * (1 + 0.005 * random.normal()));
    }
  depth.at(64, 64) = std::numeric_limits<float>::infinity();
  const auto normals = smooth_normals_from_depth(depth, rays, 6);
  constexpr double kTurn_rad = 0.05;
  for (int y = 16; y < 112; y += 8)
    for (int x = 16; x < 112; x += 8)
      EXPECT_LT(std::acos(normals[depth.index(x, y)].cast<double>().dot(normal)), kTurn_rad)
          << x << ", " << y;
}

}  // namespace
}  // namespace organbake
