// SPDX-License-Identifier: GPL-3.0-or-later

#include <Eigen/LU>
#include <atomic>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/image/srgb.h"
#include "organbake/isosurface/isosurface.h"
#include "organbake/phantom/phantom.h"
#include "organbake/raycast/ray_scene.h"
#include "support/files.h"
#include "support/testing.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

OrganPhantomOptions small_scan() {
  OrganPhantomOptions options;
  options.ct_size = {64, 64, 48};
  options.spacing_mm = {2, 2, 3};
  return options;
}

TEST(Scan, HasTheGridAskedForAwayFromTheOrigin) {
  const OrganPhantomOptions options = small_scan();
  const Volume ct = OrganPhantom(options).scan();
  EXPECT_EQ(ct.size, options.ct_size);
  EXPECT_EQ(ct.spacing_mm, options.spacing_mm);
  EXPECT_EQ(ct.direction, Eigen::Matrix3d::Identity());
  EXPECT_EQ(ct.voxels.size(), 64u * 64 * 48);
  const Vector3d center = ct.world_from_index(Vector3d(31.5, 31.5, 23.5));
  EXPECT_GT(center.cwiseAbs().minCoeff(), 5) << "a lost origin must show in every axis";
  EXPECT_LT(center.norm(), 50);
}

TEST(Scan, IsWaterBesideAirWithoutNoise) {
  OrganPhantomOptions options = small_scan();
  options.noise_hu = 0;
  const OrganPhantom phantom(options);
  const Volume ct = phantom.scan();
  const double reach = options.spacing_mm.norm();  // a voxel's diagonal, with slopes up to 2
  for_each_voxel(ct.size, [&](int i, int j, int k) {
    const double inside = phantom.inside(ct.world_from_index(Vector3d(i, j, k)));
    const int hu = ct.at(i, j, k);
    EXPECT_GE(hu, -1000);
    EXPECT_LE(hu, 60);
    if (std::abs(inside) > reach) {
      EXPECT_EQ(hu, inside > 0 ? 60 : -1000);
    }
  });
}

// Against 20 × 20 × 20 points in the voxel.
TEST(Scan, BoundaryVoxelsHoldTheirInsideShare) {
  OrganPhantomOptions options = small_scan();
  options.noise_hu = 0;
  const OrganPhantom phantom(options);
  const Volume ct = phantom.scan();
  constexpr int kPoints = 20;
  double sum2 = 0, worst = 0;
  int tested = 0;
  for (int v = 0; v < static_cast<int>(ct.voxels.size()) && tested < 300; v += 7) {
    if (ct.voxels[v] == 60 || ct.voxels[v] == -1000) continue;
    const Vector3d index(v % 64, v / 64 % 64, v / (64 * 64));
    int inside = 0;
    for (int p = 0; p < kPoints * kPoints * kPoints; ++p) {
      const Vector3d at(p % kPoints, p / kPoints % kPoints, p / (kPoints * kPoints));
      const Vector3d within = (at + Vector3d::Constant(0.5)) / kPoints - Vector3d::Constant(0.5);
      inside += phantom.inside(ct.world_from_index(index + within)) > 0;
    }
    const double share = double(inside) / (kPoints * kPoints * kPoints);
    const double error = (ct.voxels[v] + 1000) / 1060.0 - share;
    sum2 += error * error;
    worst = std::max(worst, std::abs(error));
    ++tested;
  }
  ASSERT_EQ(tested, 300);
  EXPECT_LT(std::sqrt(sum2 / tested), 0.015);
  EXPECT_LT(worst, 0.04);  // a box's ramp is not exactly a cut box's volume
}

TEST(Scan, NoiseHasItsStrengthAndNoPattern) {
  OrganPhantomOptions options = small_scan();
  options.noise_hu = 12;
  const Volume ct = OrganPhantom(options).scan();
  // The first slice is air. Neighbours along and across rows must not know of each other.
  double sum = 0, sum2 = 0, along = 0, across = 0;
  const int count = 64 * 64;
  for (int v = 0; v < count; ++v) {
    const double noise = ct.voxels[v] + 1000;
    sum += noise;
    sum2 += noise * noise;
    along += noise * (ct.voxels[v + 1] + 1000);
    across += noise * (ct.voxels[v + 64] + 1000);
  }
  const double variance = sum2 / count;
  EXPECT_NEAR(sum / count, 0, 4 * 12 / std::sqrt(count));
  EXPECT_NEAR(std::sqrt(variance), 12, 0.6);  // four standard errors of a standard deviation
  EXPECT_NEAR(along / count / variance, 0, 4 / std::sqrt(count));
  EXPECT_NEAR(across / count / variance, 0, 4 / std::sqrt(count));
}

TEST(Scan, SameVoxelsForAnyNumberOfThreads) {
  const OrganPhantomOptions options = small_scan();
  const auto scan_with = [&](std::size_t threads) {
    const ThreadLimit limit(threads);
    return OrganPhantom(options).scan().voxels;
  };
  EXPECT_EQ(scan_with(1), scan_with(4));
}

TEST(Scan, CanBeCancelled) {
  const std::atomic<bool> cancel = true;
  const RunContext context({}, {}, &cancel);
  EXPECT_THROW(OrganPhantom(small_scan()).scan(context), CancelledError);
}

// The paper's phantom scan gave 80,744 faces; ours, on the same grid, must be as hard.
TEST(OrganIsosurface, HasThePapersFaceCountAndIsTheOrgan) {
  constexpr double kPaperFaces = 80744;
  const OrganPhantom phantom(OrganPhantomOptions{});
  IsosurfaceOptions options;
  options.iso_hu = -470;  // half-way between organ and air: where partial volume puts the surface
  const TriangleMesh mesh = extract_isosurface(phantom.scan(), options).mesh;
  EXPECT_NEAR(static_cast<double>(mesh.faces.size()) / kPaperFaces, 1, 0.1);
  const MeshTopology topology = analyse_topology(mesh);
  EXPECT_TRUE(topology.closed_manifold());
  EXPECT_EQ(topology.euler_characteristic, 2) << "one piece, no handles";

  double sum = 0;
  for (const auto& vertex : mesh.vertices) sum += std::abs(phantom.inside(vertex));
  // Slices 3 mm apart and a ramp that is not linear: a tenth of a slice.
  EXPECT_LT(sum / static_cast<double>(mesh.vertices.size()), 0.3);
}

using Eigen::Vector2d;

OrganPhantomOptions small_photos() {
  OrganPhantomOptions options;
  options.photo_count = 4;
  options.photo_size = 200;
  return options;
}

bool is_black(const std::uint8_t* rgb) { return rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0; }

// The truth mesh, traced through the same pixels, must have the photograph's silhouette: only
// pixels that the outline crosses may differ.
TEST(Photograph, SilhouetteIsTheTruthMeshs) {
  const OrganPhantom phantom(small_photos());
  const RayScene truth(phantom.surface(6));
  for (const PosedCamera& camera : phantom.photo_cameras()) {
    const Rgb8Image photo = phantom.photograph(camera);
    const Eigen::Matrix3d world_from_camera = camera.camera_from_world.rotation.transpose();
    std::vector<Ray> rays(photo.width * photo.height);
    for (int p = 0; p < photo.width * photo.height; ++p) {
      const Vector2d pixel(p % photo.width + 0.5, p / photo.width + 0.5);
      rays[p].origin = camera.center_world_mm();
      rays[p].direction = world_from_camera * unproject(camera.intrinsics, pixel);
    }
    std::vector<RayHit> hits(rays.size());
    truth.first_hits(rays, hits);
    int organ = 0, differing = 0;
    for (int p = 0; p < photo.width * photo.height; ++p) {
      const bool hit = hits[p].face != kNoHit;
      const bool seen = !is_black(&photo.pixels[3 * p]);
      organ += hit;
      differing += hit != seen;
      if (hit && !seen) ADD_FAILURE() << "a hole at pixel " << p << " of " << camera.name;
    }
    EXPECT_GT(organ, 200 * 200 / 5);
    EXPECT_LT(differing, 4 * 200) << "partly covered pixels along one outline, no more";
  }
}

// Pixels at projected truth points show diffuse + specular light there, to the photograph's
// 8 bits and a pixel's blur.
TEST(Photograph, ShowsTheTruthsColoursInPlace) {
  const OrganPhantom phantom(small_photos());
  const TriangleMesh truth = phantom.surface(5);
  const RayScene scene(truth);
  for (const PosedCamera& camera : phantom.photo_cameras()) {
    const Rgb8Image photo = phantom.photograph(camera);
    std::vector<double> errors;
    for (std::size_t v = 0; v < truth.vertices.size(); v += 3) {
      const Vector3d& point = truth.vertices[v];
      const Vector3d normal = phantom.normal(point);
      const Vector3d to_eye = (camera.center_world_mm() - point).normalized();
      if (normal.dot(to_eye) < 0.5) continue;
      Ray shadow{point + 0.5 * normal, to_eye};
      std::uint8_t hidden = 0;
      scene.occluded({&shadow, 1}, {&hidden, 1});
      if (hidden) continue;
      const Vector3d light =
          phantom.albedo(point).cast<double>().cwiseProduct(studio_lighting().diffuse(normal)) +
          studio_lighting().glossy(normal, to_eye);
      const Vector2d pixel = project(camera, point);
      const auto* rgb = photo.at(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
      for (int c = 0; c < 3; ++c)
        errors.push_back(
            std::abs(rgb[c] - double(srgb8_from_linear(static_cast<float>(light[c])))));
    }
    ASSERT_GT(errors.size(), 1000u);
    std::sort(errors.begin(), errors.end());
    EXPECT_LT(errors[errors.size() / 2], 4);  // of 255; half a pixel is 0.4 mm of texture
    EXPECT_LT(errors[errors.size() * 95 / 100], 25);
  }
}

TEST(Photograph, SamePixelsForAnyNumberOfThreads) {
  OrganPhantomOptions options = small_photos();
  options.photo_size = 120;
  const auto photo_with = [&](std::size_t threads) {
    const ThreadLimit limit(threads);
    const OrganPhantom phantom(options);
    return phantom.photograph(phantom.photo_cameras()[1]).pixels;
  };
  EXPECT_EQ(photo_with(1), photo_with(4));
}

TEST(Photograph, ACameraThatLooksAwaySeesBlack) {
  const OrganPhantom phantom(small_photos());
  PosedCamera camera = phantom.photo_cameras()[0];
  const Vector3d eye = camera.center_world_mm();
  camera.camera_from_world = look_at(eye, eye - camera.view_direction_world(), Vector3d::UnitZ());
  for (const std::uint8_t value : phantom.photograph(camera).pixels) ASSERT_EQ(value, 0);
}

TEST(PhotoCameras, EachFramesTheWholeOrganClosely) {
  OrganPhantomOptions options;
  options.photo_count = 11;
  options.photo_size = 640;
  const OrganPhantom phantom(options);
  const std::vector<Vector3d> vertices = phantom.surface(5).vertices;
  const std::vector<PosedCamera> cameras = phantom.photo_cameras();
  ASSERT_EQ(cameras.size(), 11u);
  for (const PosedCamera& camera : cameras) {
    EXPECT_NO_THROW(camera.intrinsics.check());
    double least_margin = 640;
    for (const Vector3d& vertex : vertices) {
      EXPECT_GT((camera.camera_from_world * vertex).z(), 0);
      const Vector2d pixel = project(camera, vertex);
      least_margin =
          std::min({least_margin, pixel.x(), pixel.y(), 640 - pixel.x(), 640 - pixel.y()});
    }
    EXPECT_GT(least_margin, 0.02 * 640) << camera.name;
    EXPECT_LT(least_margin, 0.04 * 640) << camera.name << ": wastes its frame";
  }
}

TEST(PhotoCameras, AreProperPosesFromAllRound) {
  OrganPhantomOptions options;
  options.photo_count = 12;
  const std::vector<PosedCamera> cameras = OrganPhantom(options).photo_cameras();
  std::set<std::string> names;
  Vector3d mean = Vector3d::Zero();
  for (const PosedCamera& camera : cameras) {
    const Eigen::Matrix3d& rotation = camera.camera_from_world.rotation;
    EXPECT_LT((rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    EXPECT_NEAR(rotation.determinant(), 1, 1e-12);
    names.insert(camera.name);
    mean += camera.view_direction_world() / 12;
    // Neither square pixels nor a centred axis: what tells a swapped intrinsic.
    EXPECT_NE(camera.intrinsics.fx, camera.intrinsics.fy);
    EXPECT_NE(camera.intrinsics.cx, camera.intrinsics.cy);
    EXPECT_NE(camera.intrinsics.cx, 0.5 * camera.intrinsics.width);
  }
  EXPECT_EQ(names.size(), 12u);
  EXPECT_LT(mean.norm(), 0.1);
}

TEST(PhotoCameras, OnePhotoWorksToo) {
  OrganPhantomOptions options;
  options.photo_count = 1;
  EXPECT_EQ(OrganPhantom(options).photo_cameras().size(), 1u);
}

}  // namespace
}  // namespace organbake
