// SPDX-License-Identifier: GPL-3.0-or-later

#include <atomic>

#include "organbake/capture/traced_surface.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/shell.h"
#include "organbake/raycast/face_queries.h"
#include "organbake/raycast/ray_scene.h"
#include "support/error_message.h"
#include "support/testing.h"
#include "unit/capture/scenes.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(CaptureOptions, DefaultsAreValid) { EXPECT_NO_THROW(CaptureOptions().check()); }

TEST(CaptureOptions, EachBoundIsKept) {
  const auto refused = [](auto change) {
    CaptureOptions options;
    change(options);
    EXPECT_THROW(options.check(), UsageError);
  };
  refused([](auto& o) { o.rays_per_texel_side = -1; });
  refused([](auto& o) { o.rays_per_texel_side = 17; });
  refused([](auto& o) { o.base_step_mm = 0; });
  refused([](auto& o) { o.base_step_mm = 1001; });
  refused([](auto& o) { o.base_step_mm = kNaN; });
}

struct Inputs {
  TriangleMesh surface = painted(sphere_mesh(20, 2), {0.5f, 0.4f, 0.3f});
  TriangleMesh proxy = sphere_mesh(20, 1);
  std::vector<PosedCamera> cameras = {plain_camera({0, -90, 0}, Vector3d::Zero(), 32)};

  CaptureResult run() const {
    return capture(surface, proxy, cameras, *make_material_color({}), {});
  }
};

TEST(CaptureInputs, BrokenOnesAreRefused) {
  const auto refused = [](auto change) {
    Inputs inputs;
    change(inputs);
    EXPECT_THROW(inputs.run(), BadDataError);
  };
  refused([](auto& in) { in.surface = {}; });
  refused([](auto& in) { in.proxy = {}; });
  refused([](auto& in) { in.surface.vertices[3].x() = kNaN; });
  refused([](auto& in) { in.proxy.faces[0][1] = 999999; });
  refused([](auto& in) { in.cameras.clear(); });
  refused([](auto& in) { in.cameras[0].intrinsics.fx = 0; });
  refused([](auto& in) { in.cameras[0].camera_from_world.translation.y() = kNaN; });
  refused([](auto& in) { in.cameras[0].camera_from_world.rotation *= 2; });
  refused([](auto& in) { in.cameras[0].camera_from_world.rotation.row(0) *= -1; });
  refused([](Inputs& i) {  // another organ's, or of another coordinate system
    for (Vector3d& v : i.proxy.vertices) v.x() += 1e5;
  });
}

TEST(CaptureInputs, CanBeCancelled) {
  const Inputs inputs;
  const std::atomic<bool> cancel = true;
  EXPECT_THROW(capture(inputs.surface, inputs.proxy, inputs.cameras, *make_material_color({}), {},
                       RunContext({}, {}, &cancel)),
               CancelledError);
}

TEST(CaptureInputs, OneTexelCameraWorks) {
  Inputs inputs;
  inputs.cameras[0].intrinsics = {1, 1, 1, 1, 0.5, 0.5};
  const CaptureResult summary = inputs.run();
  EXPECT_NEAR(summary.maps[0].depth_mm[0], 70, 0.5);
}

template <class Value>
bool same_bytes(const std::vector<Value>& a, const std::vector<Value>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Value)) == 0;
}

TEST(CaptureInputs, SameBytesForAnyNumberOfThreads) {
  const TriangleMesh surface = painted(lumpy_mesh(30, 4), {0.5f, 0.4f, 0.3f});
  const TriangleMesh proxy = lumpy_mesh(30, 1);
  const std::vector<PosedCamera> cameras = {odd_camera({0, -110, 10}, Vector3d::Zero()),
                                            plain_camera({90, 60, 0}, Vector3d::Zero(), 70)};
  const auto run = [&](std::size_t threads) {
    const ThreadLimit limit(threads);
    std::vector<Photo> photos = {photo_of(surface, plain_camera({100, 10, 50}, {0, 0, 0}, 90)),
                                 photo_of(surface, plain_camera({-9, -120, 5}, {0, 0, 0}, 80))};
    const auto color = make_photo_color(surface, std::move(photos));
    return capture(surface, proxy, cameras, *color, {});
  };
  const CaptureResult one = run(1), four = run(4);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    EXPECT_TRUE(same_bytes(one.maps[c].depth_mm, four.maps[c].depth_mm));
    EXPECT_TRUE(same_bytes(one.maps[c].color, four.maps[c].color));
    EXPECT_TRUE(same_bytes(one.maps[c].height_mm, four.maps[c].height_mm));
    EXPECT_TRUE(same_bytes(one.maps[c].face, four.maps[c].face));
    EXPECT_TRUE(same_bytes(one.maps[c].confidence, four.maps[c].confidence));
  }
  EXPECT_TRUE(same_bytes(one.base.height_mm, four.base.height_mm));
  EXPECT_TRUE(same_bytes(one.base.color, four.base.color));
  EXPECT_EQ(one.base.seen_by, four.base.seen_by);
  EXPECT_EQ(one.bound_in_prism, four.bound_in_prism);
  EXPECT_EQ(one.largest_height_mm, four.largest_height_mm);
}

using ::testing::HasSubstr;

CaptureResult capture_plainly(const TriangleMesh& surface, const TriangleMesh& proxy,
                              const std::vector<PosedCamera>& cameras) {
  return capture(surface, proxy, cameras, *make_material_color({}), {});
}

// Depth of the first crossing of a sphere, planar; infinite when missed.
double sphere_depth(const Ray& ray, const Vector3d& center, double radius) {
  const Vector3d from = ray.origin - center;
  const double a = ray.direction.squaredNorm(), b = from.dot(ray.direction);
  const double root = b * b - a * (from.squaredNorm() - radius * radius);
  return root < 0 ? INFINITY : (-b - std::sqrt(root)) / a;
}

constexpr double kKeptCosine = 0.174;  // nearer to grazing than 80° nothing is kept

TEST(CaptureDepth, IsThePlanarDepthOfASphere) {
  const Vector3d center(7, -3, 12);
  constexpr double kRadius = 30;
  const PosedCamera camera = odd_camera({40, -100, 30}, center + Vector3d(4, 0, 2));
  const CaptureResult summary = capture_plainly(moved(sphere_mesh(kRadius, 6), center),
                                                moved(sphere_mesh(kRadius, 1), center), {camera});
  const CameraMaps& maps = summary.maps[0];
  ASSERT_EQ(maps.width, 150);
  ASSERT_EQ(maps.height, 90);
  const CameraRays rays(camera);
  constexpr double kSagittaMm =
      0.006;  // an icosphere of 81,920 faces: edges of 0.55 mm, e² / (8R) · 4/3
  int compared = 0;
  for (int y = 0; y < maps.height; ++y)
    for (int x = 0; x < maps.width; ++x) {
      const Ray ray = rays.through(x + 0.5, y + 0.5);
      const double depth = maps.depth_mm[y * maps.width + x];
      const double truth = sphere_depth(ray, center, kRadius);
      const Vector3d point = ray.origin + truth * ray.direction;
      const double cosine =
          std::isinf(truth) ? 0 : -(point - center).normalized().dot(ray.direction.normalized());
      if (std::abs(cosine - kKeptCosine) < 0.02) continue;
      ASSERT_EQ(std::isfinite(depth), cosine > kKeptCosine) << x << ", " << y;
      if (std::isinf(depth)) continue;
      EXPECT_NEAR(depth, truth, kSagittaMm / cosine + 1e-5);
      ++compared;
    }
  EXPECT_GT(compared, 3000);
}

TEST(CaptureDepth, IsTheMeshsToFloatPrecision) {
  const TriangleMesh surface = lumpy_mesh(25, 3);
  const PosedCamera camera = odd_camera({10, 80, -40}, {2, 1, 3});
  const CameraMaps maps = capture_plainly(surface, lumpy_mesh(25, 1), {camera}).maps[0];
  const CameraRays rays(camera);
  for (int p = 0; p < maps.width * maps.height; p += 13) {
    const Ray ray = rays.through(p % maps.width + 0.5, p / maps.width + 0.5);
    double nearest = INFINITY, cosine = 0;
    for (const auto& [a, b, c] : surface.faces) {
      const PlaneCrossing crossing =
          cross_plane({surface.vertices[a], surface.vertices[b], surface.vertices[c]}, ray.origin,
                      ray.direction);
      if (!crossing.inside_by(-1e-12) || !(crossing.t > 0) || crossing.t > nearest) continue;
      nearest = crossing.t;
      const Vector3d normal = (surface.vertices[b] - surface.vertices[a])
                                  .cross(surface.vertices[c] - surface.vertices[a])
                                  .normalized();
      cosine = -normal.dot(ray.direction.normalized());
    }
    constexpr double kLean = 0.2;  // of smooth normals on faces as large as these
    if (cosine > kKeptCosine + kLean) {
      ASSERT_TRUE(std::isfinite(maps.depth_mm[p]));
    }
    if (std::isfinite(maps.depth_mm[p])) {
      ASSERT_TRUE(std::isfinite(nearest));
      constexpr double kStoredShare = 1.0 / (1 << 17);  // half of the last bit that is kept
      EXPECT_NEAR(maps.depth_mm[p], nearest, 1.01 * kStoredShare * nearest);
    }
  }
}

// What a player does: b from depth, height and face, then the shell's point.
TEST(CaptureBinding, MacroPlusMicroIsTheSurface) {
  const TriangleMesh surface = lumpy_mesh(30, 5), proxy = lumpy_mesh(30, 1);
  const std::vector<PosedCamera> cameras = {odd_camera({0, -120, 0}, Vector3d::Zero()),
                                            odd_camera({70, 60, 70}, Vector3d::Zero()),
                                            odd_camera({-80, 30, -60}, Vector3d::Zero())};
  const CaptureResult summary = capture_plainly(surface, proxy, cameras);
  const std::vector<Vector3d> normals = vertex_normals(proxy);
  std::size_t bound = 0;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const CameraMaps& maps = summary.maps[c];
    const CameraRays rays(cameras[c]);
    for (int p = 0; p < maps.width * maps.height; ++p) {
      if (std::isinf(maps.depth_mm[p])) {
        EXPECT_EQ(maps.face[p], kNoFace);
        EXPECT_EQ(maps.confidence[p], 0);
        EXPECT_EQ(maps.height_mm[p], 0);
        continue;
      }
      ASSERT_LT(maps.face[p], proxy.faces.size());
      const Ray ray = rays.through(p % maps.width + 0.5, p / maps.width + 0.5);
      const Vector3d point = ray.origin + double(maps.depth_mm[p]) * ray.direction;
      const ShellMatrix shell = shell_matrix(proxy, normals, maps.face[p]);
      const Eigen::Vector2d b = barycentric_at_height(shell, maps.height_mm[p], point);
      // Half of the last bit that a height keeps, and rounding.
      const double stored_mm = maps.depth_mm[p] / (1 << 19) + 2e-6;
      EXPECT_LT((shell_point(shell, b[0], b[1], maps.height_mm[p]) - point).norm(), stored_mm);
      EXPECT_LE(std::abs(maps.height_mm[p]), summary.largest_height_mm + stored_mm);
      ++bound;
    }
  }
  EXPECT_GT(bound, 10000u);
  EXPECT_EQ(summary.bound_in_prism + summary.bound_by_fallback, bound);
  EXPECT_LT(double(summary.bound_by_fallback), 0.001 * double(bound));
  EXPECT_EQ(summary.back_face_texels, 0u);
}

// About the middle of a box its prisms have closed: no height there says where a texel lies.
TEST(CaptureBinding, TexelsThatNoFaceCarriesAreBackgroundAndCounted) {
  TriangleMesh proxy = box_mesh({100, 100, 100});
  for (auto& v : proxy.vertices) v -= Vector3d::Constant(50);
  const CaptureResult summary =
      capture_plainly(sphere_mesh(0.01, 3), proxy, {plain_camera({0, -0.04, 0}, {0, 0, 0}, 40)});
  EXPECT_GT(summary.unbound_texels, 400u);
  EXPECT_EQ(summary.bound_in_prism + summary.bound_by_fallback, 0u);
  for (const float depth : summary.maps[0].depth_mm) EXPECT_TRUE(std::isinf(depth));
}

// The farther the camera, the coarser its heights.
TEST(CaptureBinding, FromAfarNoHeightLeadsAcrossTheBody) {
  TriangleMesh proxy = box_mesh({100, 100, 100});
  for (auto& v : proxy.vertices) v -= Vector3d::Constant(50);
  PosedCamera camera = plain_camera({0, -1e5, 0}, {0, 0, 0}, 40);
  camera.intrinsics.fx = camera.intrinsics.fy = 4e5;  // 10 mm across
  const CaptureResult summary = capture_plainly(sphere_mesh(4, 3), proxy, {camera});
  const CameraMaps& maps = summary.maps[0];
  const CameraRays rays(camera);
  const std::vector<ShellMatrix> shells = shell_matrices(proxy);
  std::size_t bound = 0;
  for (int p = 0; p < maps.width * maps.height; ++p) {
    if (maps.face[p] == kNoFace) continue;
    const Ray ray = rays.through(p % maps.width + 0.5, p / maps.width + 0.5);
    const Vector3d point = ray.origin + double(maps.depth_mm[p]) * ray.direction;
    const ShellMatrix& shell = shells.at(maps.face[p]);
    const Eigen::Vector2d b = barycentric_at_height(shell, maps.height_mm[p], point);
    // The depth's last bit.
    EXPECT_LE((shell_point(shell, b[0], b[1], maps.height_mm[p]) - point).norm(), 1e5 / (1 << 16));
    ++bound;
  }
  EXPECT_GT(bound, 100u);
}

// A red dot on one side of a green organ must appear where it projects: no mirror, no transpose.
TEST(CaptureColor, AMarkIsWhereItProjects) {
  TriangleMesh surface = painted(sphere_mesh(30, 5), {0.1f, 0.6f, 0.1f});
  const Vector3d mark(12, -24, 13.4);
  for (std::size_t v = 0; v < surface.vertices.size(); ++v)
    if ((surface.vertices[v] - mark).norm() < 4) surface.colors[v] = {0.9f, 0.1f, 0.1f};
  const PosedCamera camera = odd_camera({30, -110, 40}, {3, 0, 2});
  const CameraMaps maps =
      capture(surface, sphere_mesh(30, 1), {camera}, *make_vertex_color(surface), {}).maps[0];
  Eigen::Vector2d sum(0, 0);
  double weight = 0;
  for (int p = 0; p < maps.width * maps.height; ++p) {
    const double red = maps.color[p].x() > maps.color[p].y() ? 1 : 0;
    sum += red * Eigen::Vector2d(p % maps.width + 0.5, p / maps.width + 0.5);
    weight += red;
  }
  ASSERT_GT(weight, 20);
  EXPECT_LT((sum / weight - project(camera, mark.normalized() * 30)).norm(), 1.0);
}

TEST(CaptureDepth, ASurfaceSeenFromInsideIsBackground) {
  const CaptureResult summary = capture_plainly(sphere_mesh(50, 3), sphere_mesh(50, 1),
                                                {plain_camera({1, 2, 3}, {10, 0, 0}, 40)});
  EXPECT_EQ(summary.back_face_texels, 1600u);
  EXPECT_EQ(summary.bound_in_prism + summary.bound_by_fallback, 0u);
  for (const float depth : summary.maps[0].depth_mm) EXPECT_TRUE(std::isinf(depth));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { check_filled(summary, "organ.ply"); }),
              HasSubstr("organ.ply: 100 % of the texels that see it see it from behind"));
}

TEST(CaptureDepth, AnInsideOutSurfaceIsBackgroundAndCounted) {
  TriangleMesh surface = sphere_mesh(50, 3);
  for (Face& face : surface.faces) std::swap(face[1], face[2]);
  const CaptureResult summary =
      capture_plainly(surface, sphere_mesh(50, 1), {plain_camera({0, -200, 0}, {0, 0, 0}, 40)});
  EXPECT_GT(summary.back_face_texels, 400u);
  EXPECT_EQ(summary.bound_in_prism + summary.bound_by_fallback, 0u);
  message_of(ExitCode::bad_data, [&] { check_filled(summary, "organ.ply"); });
}

// An organ of centimetres beside a proxy of millimetres, as units at odds once gave them.
TEST(CaptureDepth, EmptyMapsAreRefusedAndOthersAreNot) {
  const std::vector<PosedCamera> cameras = {plain_camera({0, -200, 0}, {0, 0, 0}, 40)};
  EXPECT_NO_THROW(
      check_filled(capture_plainly(sphere_mesh(50, 3), sphere_mesh(50, 1), cameras), "organ.ply"));
  const CaptureResult away = capture_plainly(sphere_mesh(50, 3), sphere_mesh(50, 1),
                                             {plain_camera({0, -200, 0}, {0, -400, 0}, 40)});
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { check_filled(away, "organ.ply"); }),
              HasSubstr("organ.ply: all maps are empty, because no camera sees it"));
}

TEST(CaptureDepth, ACameraThatLooksAwaySeesNothing) {
  const CaptureResult summary = capture_plainly(sphere_mesh(50, 3), sphere_mesh(50, 1),
                                                {plain_camera({0, -200, 0}, {0, -400, 0}, 40)});
  for (const std::uint32_t face : summary.maps[0].face) EXPECT_EQ(face, kNoFace);
}

TEST(CaptureDepth, LensDistortionIsKept) {
  PosedCamera camera = odd_camera({0, -120, 0}, Vector3d::Zero());
  camera.intrinsics.k1 = -0.2;
  camera.intrinsics.p1 = 0.003;
  const CameraMaps maps = capture_plainly(sphere_mesh(30, 5), sphere_mesh(30, 1), {camera}).maps[0];
  int seen = 0;
  for (int p = 0; p < maps.width * maps.height; p += 7) {
    if (std::isinf(maps.depth_mm[p])) continue;
    const Eigen::Vector2d pixel(p % maps.width + 0.5, p / maps.width + 0.5);
    const Vector3d in_camera = double(maps.depth_mm[p]) * unproject(camera.intrinsics, pixel);
    const Vector3d world = camera.camera_from_world.inverse() * in_camera;
    EXPECT_NEAR(world.norm(), 30, 0.03);
    EXPECT_LT((project(camera, world) - pixel).norm(), 1e-6);
    ++seen;
  }
  EXPECT_GT(seen, 300);
}

}  // namespace
}  // namespace organbake
