// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <set>

#include "organbake/core/parallel.h"
#include "organbake/image/srgb.h"
#include "organbake/phantom/phantom.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

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

TEST(Photograph, NoSideIsBlackAndNoneIsBlownOut) {
  const OrganPhantom phantom(small_photos());
  for (const PosedCamera& camera : phantom.photo_cameras()) {
    const Rgb8Image photo = phantom.photograph(camera);
    int organ = 0, dark = 0, white = 0;
    for (std::size_t p = 0; p < photo.pixels.size(); p += 3) {
      const std::uint8_t* rgb = &photo.pixels[p];
      if (is_black(rgb)) continue;
      ++organ;
      dark += rgb[0] < 40;
      white += rgb[0] == 255 && rgb[1] == 255 && rgb[2] == 255;
    }
    EXPECT_LT(dark, organ / 25) << "outline pixels mix with the background, others do not";
    EXPECT_LT(white, organ / 100);
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

using Eigen::Vector2d;
using Eigen::Vector3d;

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
