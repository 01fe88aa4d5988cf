// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/depth_maps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <map>

#include "known_depth.h"
#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/shading/prepared_frame.h"

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

const Intrinsics kCamera = assumed_camera(40, 30, 1.0);

TEST(DepthMesh, AFlatWallIsOneSheetFacingTheCamera) {
  const TriangleMesh mesh =
      mesh_from_depth(Plane(40, 30, 50), Rgb8Image(40, 30), kCamera, {.step_px = 1});
  EXPECT_EQ(mesh.vertices.size(), 1200u);
  EXPECT_EQ(mesh.faces.size(), 2u * 39 * 29);
  EXPECT_EQ(mesh.colors.size(), mesh.vertices.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) EXPECT_LT(face_normal(mesh, f).z(), -0.99);
}

TEST(DepthMesh, TornAtJumpsAndHolesStayHoles) {
  Plane depth(40, 30, 50);
  for (int y = 0; y < 30; ++y)
    for (int x = 34; x < 40; ++x) depth.at(x, y) = 90;
  depth.at(10, 10) = std::numeric_limits<float>::infinity();
  DepthMeshOptions options{.step_px = 1, .tear = 0.06, .largest_only = false};
  const TriangleMesh both = mesh_from_depth(depth, Rgb8Image(40, 30), kCamera, options);
  EXPECT_EQ(analyse_topology(both).components, 2u);
  options.largest_only = true;
  const TriangleMesh front = mesh_from_depth(depth, Rgb8Image(40, 30), kCamera, options);
  EXPECT_EQ(analyse_topology(front).components, 1u);
  EXPECT_EQ(analyse_topology(front).euler_characteristic, 0) << "a sheet with one hole";
  for (const auto& vertex : front.vertices) EXPECT_LT(vertex.z(), 60);
}

// A border that meets the frame's edge aslant goes straight on to it.
TEST(DepthMesh, ABorderDoesNotFlareAtTheFramesEdge) {
  const Intrinsics camera = assumed_camera(320, 240, 1.0);
  Plane depth(320, 240, std::numeric_limits<float>::infinity());
  for (int y = 0; y < 240; ++y)
    for (int x = std::max(0, 120 - y); x < 320; ++x) depth.at(x, y) = 50;
  const TriangleMesh mesh = mesh_from_depth(depth, Rgb8Image(320, 240), camera, {.step_px = 1});
  double least_at_edge = 1e9, least_below = 1e9;
  for (const auto& vertex : mesh.vertices) {
    const Eigen::Vector2d pixel = project(camera, vertex);
    if (pixel.y() < 1) least_at_edge = std::min(least_at_edge, pixel.x() + pixel.y());
    if (pixel.y() > 20 && pixel.y() < 60)
      least_below = std::min(least_below, pixel.x() + pixel.y());
  }
  EXPECT_NEAR(least_at_edge, least_below, 1) << "a window that ends at the edge bends it outward";
}

// Pixels end in stairs; what is cut out of them is round.
TEST(DepthMesh, ADiscOfPixelsHasARoundBorder) {
  const Intrinsics camera = assumed_camera(320, 240, 1.0);
  constexpr double kRadius_px = 90, kStair_px = 4;
  Plane depth(320, 240, std::numeric_limits<float>::infinity());
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) {
      const double u = kStair_px * std::floor((x - 160) / kStair_px) + 0.5 * kStair_px;
      const double v = kStair_px * std::floor((y - 120) / kStair_px) + 0.5 * kStair_px;
      if (std::hypot(u, v) < kRadius_px) depth.at(x, y) = 50;
    }
  const TriangleMesh mesh = mesh_from_depth(depth, Rgb8Image(320, 240), camera, {.step_px = 3});
  std::map<std::uint64_t, int> uses;
  for (const auto& face : mesh.faces)
    for (int k = 0; k < 3; ++k) ++uses[edge_key(face[k], face[(k + 1) % 3])];
  double sum = 0, squares = 0, count = 0;
  for (const auto& [edge, faces] : uses) {
    if (faces != 1) continue;
    for (const auto vertex : {std::uint32_t(edge >> 32), std::uint32_t(edge)}) {
      const Eigen::Vector2d pixel = project(camera, mesh.vertices[vertex]);
      const double radius = (pixel - Eigen::Vector2d(160, 120)).norm();
      sum += radius, squares += radius * radius, ++count;
    }
  }
  ASSERT_GT(count, 100);
  const double mean = sum / count;
  EXPECT_LT(std::sqrt(std::max(0.0, squares / count - mean * mean)), 0.85)
      << "stairs of 4 px alone are 1.2 px off";
  EXPECT_NEAR(mean, kRadius_px, 4);
}

TEST(DepthMesh, NothingToMeshIsAnError) {
  EXPECT_THROW(mesh_from_depth(Plane(40, 30, std::numeric_limits<float>::infinity()),
                               Rgb8Image(40, 30), kCamera, {}),
               BadDataError);
  EXPECT_THROW(mesh_from_depth(Plane(4, 3, 5), Rgb8Image(40, 30), kCamera, {}), BadDataError);
  EXPECT_THROW((DepthMeshOptions{.step_px = 0}.check()), UsageError);
  EXPECT_THROW((DepthMeshOptions{.tear = 0}.check()), UsageError);
}

}  // namespace

}  // namespace organbake
