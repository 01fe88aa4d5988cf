// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/depth_maps.h"

#include "known_depth.h"
#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/phantom/known_answers.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/shading/grid_filters.h"
#include "organbake/shading/prepared_frame.h"
#include "organbake/shading/shape_from_shading.h"
#include "support/testing.h"

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

// The paper's formulae in p_s, q_s as printed, with the stable gain; written from the page alone.
std::vector<double> transcription(const Plane& image, double tilt, double slant, int iterations) {
  const int w = image.width, h = image.height;
  const double ps = std::cos(tilt) * std::sin(slant) / std::cos(slant);
  const double qs = std::sin(tilt) * std::sin(slant) / std::cos(slant);
  std::vector<double> z(image.size(), 0.0), s(image.size(), 0.0);
  for (int n = 0; n < iterations; ++n) {
    std::vector<double> next(image.size());
    for (int i = 0; i < h * w; ++i) {
      double p = 0, q = 0;
      if (i % w > 0 && i / w > 0) {
        p = z[i] - z[i - 1];
        q = z[i] - z[i - w];
      }
      const double pq = 1 + p * p + q * q, light = 1 + ps * ps + qs * qs;
      const double r = (p * ps + q * qs + 1) / (std::sqrt(pq) * std::sqrt(light));
      const double f = image.values[i] - std::max(0.0, r);
      const double df =
          (p + q) * (p * ps + q * qs + 1) / (std::sqrt(pq * pq * pq) * std::sqrt(light)) -
          (ps + qs) / (std::sqrt(pq) * std::sqrt(light));
      s[i] += df * df;
      next[i] = z[i] - df / (1e-8 + s[i]) * f;
    }
    z = next;
  }
  return z;
}

TEST(TsaiShah, EqualsAnIndependentTranscription) {
  for (double tilt : {0.3, 2.0, -1.2})
    for (double slant : {0.2, 0.7, 1.2}) {
      const DistantScene scene = distant_scene("peaks", 48, {tilt, slant});
      const TsaiShahEstimate estimate =
          shade_tsai_shah(scene.intensity, {.light = {tilt, slant}, .iterations = 12});
      const std::vector<double> expected = transcription(scene.intensity, tilt, slant, 12);
      for (std::size_t k = 0; k < expected.size(); ++k)
        ASSERT_NEAR(estimate.depth.values[k], expected[k],
                    1e-9 * std::max(1.0, std::abs(expected[k])))
            << tilt << " " << slant << " pixel " << k;
    }
}

TEST(TsaiShah, StartsFromThePreviousFrame) {
  const DistantScene scene = distant_scene("gauss", 32, {0.5, 0.6});
  const TsaiShahEstimate once =
      shade_tsai_shah(scene.intensity, {.light = {0.5, 0.6}, .iterations = 4});
  const TsaiShahEstimate again =
      shade_tsai_shah(scene.intensity, {.light = {0.5, 0.6}, .iterations = 1}, &once.depth);
  EXPECT_LT(again.residual, once.residual * 1.5);
  EXPECT_NE(again.depth, once.depth);
  const Grid<double> other(5, 5);
  EXPECT_THROW(shade_tsai_shah(scene.intensity, {}, &other), BadDataError);
}

TEST(TsaiShah, SingularLightsLeaveTheDepthFinite) {
  constexpr double kPi = std::numbers::pi;
  for (double tilt : {0.0, 0.75 * kPi, -0.25 * kPi, 1.75 * kPi, kPi})
    for (double slant : {0.0, 0.5, 0.5 * kPi}) {
      const DistantScene scene = distant_scene("sphere", 24, {0.4, 0.6});
      const TsaiShahEstimate estimate =
          shade_tsai_shah(scene.intensity, {.light = {tilt, slant}, .iterations = 10000});
      for (double z : estimate.depth.values) ASSERT_LT(std::abs(z), 1e6) << tilt << " " << slant;
    }
}

TEST(TsaiShah, BoundsAreChecked) {
  EXPECT_NO_THROW(TsaiShahOptions().check());
  EXPECT_THROW((TsaiShahOptions{.light = {}, .iterations = 0}.check()), UsageError);
  EXPECT_THROW((TsaiShahOptions{.light = {NAN, 0}}.check()), UsageError);
}

// What leaks through a mask's rim is as small a part of a coarse level as of the frame.
TEST(LogRangeFit, MisfitIsTheFramesShareOfWhatAMaskHasMissed) {
  constexpr int kSide = 16, kLevels = 3, kStray = 4;
  constexpr float kBrighter = 1.5F, kVariance = 1e-4F;
  ShadedImage image{Plane(kSide, kSide, 1), Plane(kSide, kSide, kVariance), Mask(kSide, kSide, 1),
                    ray_grid({.width = kSide, .height = kSide, .fx = kSide, .fy = kSide})};
  for (int y = 0; y < kSide; ++y)
    for (int x = kSide / 2; x < kSide; ++x) image.inside.at(x, y) = 0;
  const int seen = kSide * kSide / 2;
  image.inside.at(kSide - 1, kStray) = 1;
  image.intensity.at(kSide - 1, kStray) = kBrighter;
  for (int level = 0; level < kLevels; ++level) {
    Plane v(image.rays.width, image.rays.height);  // ln r = 0: of brightness 1
    const double misfit = fit_log_range(image, {.outer_steps = 0}, v).misfit;
    EXPECT_NEAR(misfit, (kBrighter - 1) / std::sqrt(seen + 1.0), 1e-6) << "level " << level;
    image = halved(image);
  }
}

}  // namespace

// Whatever comes in, what goes out is finite and bounded, and never much worse than a flat plane.
namespace {

Intrinsics camera_of(int width, int height) {
  Intrinsics camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = std::max(width, height);
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  return camera;
}

void expect_sane(const Plane& intensity, const std::string& what) {
  const Mask inside(intensity.width, intensity.height, 1);
  const RangeEstimate near =
      shade_laparoscope(intensity, inside, camera_of(intensity.width, intensity.height), {});
  EXPECT_TRUE(all_finite(near.log_range)) << what;
  for (float v : near.log_range.values) ASSERT_LT(std::abs(v), 50) << what;
}

TEST(ShadingStress, ConstantBlackSaturatedAndTinyImages) {
  expect_sane(Plane(40, 30, 0.5F), "constant");
  expect_sane(Plane(40, 30, 0.0F), "black");
  expect_sane(Plane(40, 30, 1.0F), "saturated");
  expect_sane(Plane(64, 1, 0.7F), "one row");
  expect_sane(Plane(1, 64, 0.7F), "one column");
  expect_sane(Plane(1, 1, 0.7F), "one pixel");
  expect_sane(Plane(3, 2, 0.7F), "six pixels");
}

TEST(ShadingStress, NotFinitePixelsDoNotCount) {
  NearScene scene = near_scene(0.5, 64);
  scene.intensity.at(20, 20) = std::numeric_limits<float>::quiet_NaN();
  scene.intensity.at(40, 30) = std::numeric_limits<float>::infinity();
  scene.intensity.at(10, 50) = -3;
  const RangeEstimate estimate =
      shade_laparoscope(scene.intensity, Mask(64, 64, 1), scene.camera, {});
  EXPECT_LT(relative_error_percent(estimate.log_range, scene.log_range), 0.5);
  expect_sane(Plane(20, 20, std::numeric_limits<float>::quiet_NaN()), "all NaN");
}

TEST(ShadingStress, GainDoesNotMatter) {
  const NearScene scene = near_scene(0.5, 64);
  const RangeEstimate usual = shade_laparoscope(scene.intensity, Mask(64, 64, 1), scene.camera, {});
  for (float gain : {1e-6F, 1e6F}) {
    Plane other = scene.intensity;
    for (float& value : other.values) value *= gain;
    const RangeEstimate estimate = shade_laparoscope(other, Mask(64, 64, 1), scene.camera, {});
    EXPECT_LT(largest_difference(estimate.log_range, usual.log_range), 1e-3) << gain;
  }
}

}  // namespace
}  // namespace organbake
