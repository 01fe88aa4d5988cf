// SPDX-License-Identifier: GPL-3.0-or-later

#include "baking.h"
#include "organbake/capture/traced_surface.h"
#include "organbake/core/error.h"
#include "support/testing.h"
#include "unit/capture/scenes.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

const Vector3f kRed{0.8f, 0.05f, 0.05f}, kGreen{0.05f, 0.7f, 0.05f};

CaptureOptions with_rays(int side) {
  CaptureOptions options;
  options.rays_per_texel_side = side;
  return options;
}

// Outline texels average only what is the organ: one colour stays that colour, to the last texel.
TEST(CaptureColor, BackgroundDoesNotBleedIn) {
  const TriangleMesh surface = painted(sphere_mesh(30, 4), kRed);
  for (const int side : {1, 2, 3, 5}) {
    const CameraMaps maps =
        capture(surface, sphere_mesh(30, 1), {odd_camera({0, 0, 120}, {0, 0, 0})},
                *make_vertex_color(surface), with_rays(side))
            .maps[0];
    std::size_t beyond = 0;
    for (std::size_t p = 0; p < maps.color.size(); ++p) {
      const bool nothing = maps.face[p] == kNoFace && maps.color[p] == Vector3f(0, 0, 0);
      EXPECT_TRUE(nothing || (maps.color[p] - kRed).norm() < 1e-6) << maps.color[p].transpose();
      beyond += maps.face[p] == kNoFace && !nothing;
    }
    EXPECT_GT(beyond, 400u) << "the rings beyond the outline";
  }
}

// A map that is filtered keeps its rim: all round a texel of the organ is a colour of the organ.
TEST(CaptureColor, LeadsOnBeyondTheOutline) {
  const TriangleMesh surface = painted(sphere_mesh(30, 4), kRed);
  const CameraMaps maps = capture(surface, sphere_mesh(30, 1), {odd_camera({0, 0, 120}, {0, 0, 0})},
                                  *make_vertex_color(surface), with_rays(2))
                              .maps[0];
  for (int y = 1; y + 1 < maps.height; ++y)
    for (int x = 1; x + 1 < maps.width; ++x) {
      const auto at = [&](int dx, int dy) { return std::size_t(y + dy) * maps.width + x + dx; };
      if (maps.face[at(0, 0)] == kNoFace) continue;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) EXPECT_LT((maps.color[at(dx, dy)] - kRed).norm(), 1e-6);
    }
}

TEST(CaptureColor, ASurfaceInFrontDoesNotBleedIn) {
  const TriangleMesh scene = joined(painted(square_at({0, 30, 0}, {0.1, -1, 0.2}, 200, 4), kGreen),
                                    painted(sphere_mesh(15, 4), kRed));
  const CameraMaps maps = capture(scene, scene, {odd_camera({0, -120, 0}, {0, 0, 0})},
                                  *make_vertex_color(scene), with_rays(3))
                              .maps[0];
  int red = 0, green = 0;
  for (std::size_t p = 0; p < maps.color.size(); ++p) {
    if (maps.face[p] == kNoFace) continue;  // at a sphere's outline
    const bool is_red = (maps.color[p] - kRed).norm() < 1e-6;
    const bool is_green = (maps.color[p] - kGreen).norm() < 1e-6;
    EXPECT_TRUE(is_red || is_green) << maps.color[p].transpose();
    red += is_red;
    green += is_green;
  }
  EXPECT_GT(red, 300);
  EXPECT_GT(green, 3000);
}

// A pattern finer than a texel: one ray a texel aliases, more rays find the mean.
TEST(CaptureColor, RaysAverageWhatATexelCovers) {
  TriangleMesh surface = painted(square_at({0, 0, 0}, {0, -1, 0}, 40, 160), kRed);
  for (std::size_t v = 0; v < surface.colors.size(); ++v)
    if ((v % 161) % 2 == 0) surface.colors[v] = kGreen;            // stripes, 1 mm a period
  PosedCamera camera = plain_camera({0, -100, 0}, {0, 0, 0}, 40);  // 1.8 mm a texel
  const auto spread = [&](int side) {
    const CameraMaps maps = capture(surface, square_at({0, 0, 0}, {0, -1, 0}, 40, 2), {camera},
                                    *make_vertex_color(surface), with_rays(side))
                                .maps[0];
    double sum2 = 0;
    int count = 0;
    for (int y = 5; y < 35; ++y)
      for (int x = 5; x < 35; ++x, ++count)
        sum2 += (maps.color[y * 40 + x] - 0.5f * (kRed + kGreen)).squaredNorm();
    return std::sqrt(sum2 / count);
  };
  EXPECT_LT(spread(6), 0.3 * spread(1));
}

TEST(VertexColor, IsInterpolatedBetweenCorners) {
  TriangleMesh surface;
  surface.vertices = {{-10, 0, -10}, {10, 0, -10}, {0, 0, 12}};
  surface.faces = {{0, 1, 2}};
  surface.colors = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const auto color = make_vertex_color(surface);
  const auto samples = shade_through(surface, *color, plain_camera({0, -60, 0}, {0, 0, 0}, 60));
  ASSERT_GT(samples.size(), 200u);
  for (const auto& [point, shade] : samples) {
    const double blue = (point.z() + 10) / 22, green = (1 - blue) * 0.5 + point.x() / 20;
    EXPECT_NEAR(shade.z(), blue, 1e-5);
    EXPECT_NEAR(shade.y(), green, 1e-5);
    EXPECT_NEAR(shade.sum(), 1, 1e-5);
  }
}

TEST(VertexColor, NeedsFiniteColours) {
  TriangleMesh surface = sphere_mesh(10, 1);
  EXPECT_THROW(make_vertex_color(surface), BadDataError);
  surface = painted(surface, kRed);
  surface.colors[3].y() = NAN;
  EXPECT_THROW(make_vertex_color(surface), BadDataError);
}

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

constexpr int kSize = 24;
constexpr double kFocal = 100, kReach = 4;

std::vector<float> distances(const std::function<float(int, int)>& depth) {
  std::vector<float> map(kSize * kSize);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) map[y * kSize + x] = depth(x, y);
  return depth_edge_distance(map, kSize, kSize, kFocal, kReach);
}

TEST(DepthEdges, APlaneHasOnlyTheImagesBorder) {
  // 1 mm a texel, then five: steep, but a plane.
  for (const float slope : {0.0f, 1.0f, 5.0f}) {
    const auto map = distances([&](int x, int) { return 100 + slope * static_cast<float>(x); });
    EXPECT_FLOAT_EQ(map[12 * kSize + 12], kReach);
    EXPECT_FLOAT_EQ(map[12 * kSize], 0.5f);
    EXPECT_FLOAT_EQ(map[12 * kSize + 2], 2.5f);
    EXPECT_FLOAT_EQ(map[kSize * kSize - 1], 0.5f);
  }
}

}  // namespace
}  // namespace organbake
