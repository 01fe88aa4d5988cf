// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/depth_maps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>

#include "known_depth.h"
#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/image/srgb.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/shading/frame_source.h"
#include "organbake/shading/prepared_frame.h"
#include "support/places.h"

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

// A depth says whether its picture supports it, and is no worse than a flat plane when it does not.
namespace {

FrameDepth shaded(const Rgb8Image& image, const Intrinsics& camera) {
  return shade_frame(prepare_frame(image, camera, {}), {});
}

// The largest deviation of depth from its mean, relative.
double relief_of(const Plane& depth) {
  double sum = 0, count = 0, largest = 0;
  for (int pass = 0; pass < 2; ++pass)
    for (float z : depth.values) {
      if (!std::isfinite(z)) continue;
      if (pass == 0) sum += z, ++count;
      if (pass == 1) largest = std::max(largest, std::abs(z * count / sum - 1));
    }
  return largest;
}

// A wall across the axis in patches of two albedos but one colour: no shape has such edges.
Rgb8Image patched_wall(const Intrinsics& camera) {
  Rgb8Image image(camera.width, camera.height);
  RandomStream random(4);
  constexpr int kPatch = 24;
  std::vector<double> albedo(1000);
  for (double& value : albedo) value = random.below(2) ? 1 : 0.45;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const Eigen::Vector3d ray = unproject(camera, {x + 0.5, y + 0.5});
      const double light = albedo[std::size_t(y / kPatch) * 31 + std::size_t(x / kPatch)] /
                           std::pow(ray.squaredNorm(), 1.5);
      const double tint[3] = {0.8, 0.35, 0.3};
      for (int c = 0; c < 3; ++c)
        image.at(x, y)[c] = srgb8_from_linear(static_cast<float>(light * tint[c]));
    }
  return image;
}

TEST(DepthVerdict, RenderedTissueIsOkAndKeepsItsRelief) {
  for (int seed : {1, 2}) {
    const LaparoscopyPhantom phantom(
        {.seed = static_cast<std::uint64_t>(seed), .width = 320, .height = 240});
    const LaparoscopyFrame frame = phantom.frame(0);
    const FrameDepth depth = shaded(frame.image, frame.camera.intrinsics);
    EXPECT_EQ(depth.quality.verdict, DepthVerdict::ok) << depth.quality.reason;
    EXPECT_GT(relief_of(depth.depth), 0.05);
  }
}

TEST(DepthVerdict, PatchesOfAlbedoAreDoubtfulAndNearFlat) {
  const Intrinsics camera = assumed_camera(320, 240, 1.2);
  const FrameDepth depth = shaded(patched_wall(camera), camera);
  EXPECT_EQ(depth.quality.verdict, DepthVerdict::doubtful);
  EXPECT_THAT(depth.quality.reason, testing::HasSubstr("texture"));
  constexpr double kNearFlat = 0.02;  // a fifth of what is invented
  EXPECT_LT(relief_of(depth.depth), kNearFlat);
  EXPECT_GT(relief_of(depth_from_log_range(depth.range.log_range, ray_grid(camera),
                                           Mask(camera.width, camera.height, 1))),
            0.1)
      << "what is invented";
}

TEST(DepthVerdict, DarknessIsAFailure) {
  const FrameDepth depth = shaded(Rgb8Image(160, 120), assumed_camera(160, 120, 1.2));
  EXPECT_EQ(depth.quality.verdict, DepthVerdict::failed);
  EXPECT_FALSE(depth.quality.reason.empty());
}

TEST(DepthVerdict, ARealFrameWithoutTruthIsNotTrusted) {
  const std::filesystem::path clip = shared_data("video/laparoscopy_720p_25fps.mp4");
  if (!std::filesystem::exists(clip)) GTEST_SKIP() << "real data is missing: " << clip;
  VideoReader reader(clip);
  StoredPicture frame;
  ASSERT_TRUE(reader.next(frame));
  const FrameDepth depth =
      shade_frame(prepare_frame(frame, assumed_camera(1280, 720, 1.22), {.halvings = 1}), {});
  EXPECT_EQ(depth.quality.verdict, DepthVerdict::doubtful);
}

}  // namespace

// The evidence measures what it says on reliefs and hues made for it, and the share follows it.
// How good the share is, organbench's suite relief tells.
namespace {

constexpr int kWidth = 100, kHeight = 80;

struct Made {
  PreparedFrame frame;
  RangeEstimate estimate;
};

// ln z and ln of green by red as functions of normalised image coordinates.
template <class LogDepth, class Hue>
Made made(const LogDepth& log_z, const Hue& hue) {
  Made m;
  m.frame.camera = assumed_camera(kWidth, kHeight, 1.2);
  m.frame.color = Rgb8Image(kWidth, kHeight);
  m.frame.diffuse = m.frame.tissue = Mask(kWidth, kHeight, 1);
  m.estimate.usable = true;
  m.estimate.unexplained = 0.1;
  m.estimate.log_range = Plane(kWidth, kHeight);
  const RayGrid rays = ray_grid(m.frame.camera);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double u = rays.x(x), v = rays.y(y);
      m.estimate.log_range.at(x, y) =
          static_cast<float>(log_z(u, v) + 0.5 * std::log1p(u * u + v * v));
      const auto red = static_cast<float>(0.4);
      m.frame.color.at(x, y)[0] = srgb8_from_linear(red);
      m.frame.color.at(x, y)[1] = srgb8_from_linear(red * static_cast<float>(std::exp(hue(u, v))));
    }
  return m;
}

constexpr auto kOneHue = [](double, double) { return -0.7; };
constexpr double kClose = 0.02;  // 8-bit hues, and cells that cut the view unevenly

TEST(ReliefShare, ATiltIsToldFromABowl) {
  const Made tilted = made([](double u, double v) { return 0.3 * u - 0.2 * v; }, kOneHue);
  const Made bowl = made([](double u, double v) { return u * u + v * v; }, kOneHue);
  EXPECT_NEAR(relief_evidence(tilted.frame, tilted.estimate).tilt_share, 1, kClose);
  EXPECT_NEAR(relief_evidence(bowl.frame, bowl.estimate).tilt_share, 0, kClose);
}

TEST(ReliefShare, ReliefThatFollowsTheHueIsNoticed) {
  const auto waves = [](double u, double v) { return 0.2 * std::sin(9 * u) * std::cos(7 * v); };
  const auto pale_is_near = [&](double u, double v) { return -0.7 - 2 * waves(u, v); };
  const auto of_its_own = [](double u, double v) { return -0.7 + 0.4 * std::cos(9 * u + 7 * v); };
  const Made albedo = made(waves, pale_is_near), shape = made(waves, of_its_own);
  EXPECT_NEAR(relief_evidence(albedo.frame, albedo.estimate).hue_correlation, -1, kClose);
  EXPECT_NEAR(relief_evidence(shape.frame, shape.estimate).hue_correlation, 0, 0.1);
}

TEST(ReliefShare, WhatIsMaskedDoesNotCount) {
  Made m = made([](double u, double) { return 0.3 * u; }, kOneHue);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth / 2; ++x) {
      m.frame.diffuse.at(x, y) = 0;
      m.estimate.log_range.at(x, y) = 5;
    }
  EXPECT_NEAR(relief_evidence(m.frame, m.estimate).tilt_share, 1, kClose);
  m.frame.diffuse = Mask(kWidth, kHeight);
  EXPECT_EQ(relief_evidence(m.frame, m.estimate).tilt_share, 0);
}

TEST(ReliefShare, IsAllOfAnExplainedPictureAndFallsWithoutSteps) {
  for (const auto part : {&ReliefShare::tilt, &ReliefShare::rest}) {
    const auto share = [&](double unexplained, double tilt, double hue) {
      return relief_share({unexplained, tilt, hue}).*part;
    };
    EXPECT_EQ(share(0.02, 0, -1), 1);
    constexpr double kStep = 0.0005, kMostChange = 0.035;
    for (const double tilt : {0.0, 0.9}) {
      double before = 1;
      for (double unexplained = 0; unexplained < 0.4; unexplained += kStep) {
        EXPECT_GT(share(unexplained, tilt, 0), before - kMostChange);
        before = share(unexplained, tilt, 0);
      }
      EXPECT_LT(before, 0.8) << "hardly anything is explained";
    }
    EXPECT_GT(share(0.1, 0.4, 0.5), share(0.1, 0.4, -0.5));
  }
  EXPECT_GT(relief_share({0.1, 0.8, 0}).tilt, relief_share({0.1, 0.1, 0}).tilt);
}

// A tilt with waves on it that have none.
TEST(ReliefShare, TheTiltIsKeptWithoutTheRest) {
  const auto tilt = [](double u, double v) { return 0.3 * u - 0.2 * v; };
  Made m = made([&](double u, double v) { return tilt(u, v) + 0.1 * std::cos(20 * u); }, kOneHue);
  const RayGrid rays = ray_grid(m.frame.camera);
  Plane kept = m.estimate.log_range;
  keep_relief(rays, m.frame.tissue, {.tilt = 1, .rest = 0}, kept);
  const auto log_z = [&](int x, int y) {
    const double u = rays.x(x), v = rays.y(y);
    return kept.at(x, y) - 0.5 * std::log1p(u * u + v * v);
  };
  const double middle =
      log_z(kWidth / 2, kHeight / 2) - tilt(rays.x(kWidth / 2), rays.y(kHeight / 2));
  for (const int x : {0, 20, kWidth - 1})
    EXPECT_NEAR(log_z(x, 10) - middle, tilt(rays.x(x), rays.y(10)), 0.01);
  keep_relief(rays, m.frame.tissue, {}, kept);
  EXPECT_NEAR(log_z(0, 0), log_z(kWidth - 1, kHeight - 1), 1e-6) << "a plane across the axis";
}

// Frame by frame the share goes half the way to what a frame tells by itself.
TEST(ReliefShare, AlikeFramesEvenItOut) {
  const Made m = made([](double u, double v) { return 0.3 * u - 0.2 * v; }, kOneHue);
  const double own = judge_depth(m.frame, m.estimate).support;
  DepthQuality before;
  before.support = 0;
  EXPECT_DOUBLE_EQ(judge_depth(m.frame, m.estimate, &before).support, 0.5 * own);
  RangeEstimate taken_over = m.estimate;
  taken_over.warm = true;
  EXPECT_EQ(judge_depth(m.frame, taken_over, &before).support, 0) << "with the depth";
}

}  // namespace
}  // namespace organbake
