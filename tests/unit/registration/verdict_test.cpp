// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "lamp_studio.h"
#include "support/meshes.h"

namespace organbake {
namespace {

// The light that the photographs were taken in; and what fallbacks find is doubtful at best, so
// that they have no part in what must not be ok. Every light has its turn in tests/acceptance.
RegistrationOptions without_fallbacks() {
  RegistrationOptions options;
  options.fallbacks = false;
  options.light = LightModel::camera;
  return options;
}

PhotoToRegister near_start(std::uint64_t seed) {
  PhotoToRegister photo = lamp_studio().photo(lamp_studio().plain);
  photo.start =
      disturbed(lamp_studio().surface, lamp_studio().cameras[0].camera_from_world, 5, 5, seed);
  return photo;
}

TEST(Verdict, AMirroredMeshIsNotOk) {
  const TriangleMesh& organ = lamp_studio().surface.mesh();
  const RegisteredSurface surface(moved(mirrored(organ), {2 * bounds(organ).center().x(), 0, 0}));
  PhotoToRegister photo = near_start(1);
  EXPECT_NE(register_photo(surface, photo, without_fallbacks()).quality.verdict, Verdict::ok);
}

TEST(Verdict, AnotherOrganIsNotOk) {
  // The same lobes in other proportions: within 5 mm of each other, so it takes a photograph in
  // which that shows.
  OrganPhantomOptions options;
  options.photo_count = 8;
  options.photo_size = 512;
  const PosedCamera camera = OrganPhantom(options).photo_cameras().front();
  options.seed = 2;
  TriangleMesh other = OrganPhantom(options).surface(5);
  other.colors.clear();
  const RegisteredSurface surface(other);
  PhotoToRegister photo;
  photo.image =
      develop(picture_by_lamp(lamp_studio().phantom, lamp_studio().surface.mesh(), camera, {}), {});
  photo.intrinsics = camera.intrinsics;
  photo.start = camera.camera_from_world;
  const auto found = register_photo(surface, photo, without_fallbacks());
  EXPECT_NE(found.quality.verdict, Verdict::ok);
  EXPECT_GT(found.quality.correlation, 0.9) << "R alone would have been taken in";
}

TEST(Verdict, AWrongFocalLengthIsNotOk) {
  for (const double factor : {0.8, 1.2}) {
    PhotoToRegister photo = near_start(3);
    photo.intrinsics.fx *= factor;
    photo.intrinsics.fy *= factor;
    const auto found = register_photo(lamp_studio().surface, photo, without_fallbacks());
    EXPECT_NE(found.quality.verdict, Verdict::ok) << factor;
    EXPECT_FALSE(found.quality.reason.empty());
  }
}

TEST(Verdict, AStartBeyondReachIsOkOnlyWhenThePoseIsFoundAllTheSame) {
  const RigidTransform truth = lamp_studio().cameras[0].camera_from_world;
  PhotoToRegister photo = lamp_studio().photo(lamp_studio().plain);
  photo.start = disturbed(lamp_studio().surface, truth, 40, 150, 4);
  const auto found = register_photo(lamp_studio().surface, photo, without_fallbacks());
  const double error_mm = mtre_mm(lamp_studio().surface, truth, found.camera.camera_from_world);
  EXPECT_EQ(found.quality.verdict == Verdict::ok, error_mm < 1) << error_mm << " mm";
}

TEST(Verdict, AnOrganMostlyOutOfThePictureFails) {
  PhotoToRegister photo = near_start(5);
  photo.mask = Rgb8Image(photo.image.width, photo.image.height);
  for (int y = 0; y < photo.image.height; ++y)
    for (int x = 0; x < 110; ++x) std::fill_n(photo.mask.at(x, y), 3, 255);
  const auto found = register_photo(lamp_studio().surface, photo, without_fallbacks());
  EXPECT_EQ(found.quality.verdict, Verdict::failed);
}

// Of almost all of the outline nothing beyond the organ counts: what is left confirms the pose by
// chance as easily as not.
TEST(Verdict, AnOutlineThatHardlyShowsConfirmsNothing) {
  PhotoToRegister photo = near_start(6);
  const PosedCamera& camera = lamp_studio().cameras[0];
  const int width = photo.image.width, height = photo.image.height;
  photo.mask = Rgb8Image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      Ray ray;
      ray.origin = camera.center_world_mm();
      ray.direction = camera.camera_from_world.rotation.transpose() *
                      unproject(camera.intrinsics, {x + 0.5, y + 0.5});
      std::uint8_t organ = 0;
      lamp_studio().surface.scene().occluded({&ray, 1}, {&organ, 1});
      const bool window = std::abs(x - width / 2) < width / 8 && y < height / 2;
      if (organ || window) std::fill_n(photo.mask.at(x, y), 3, 255);
    }
  const auto found = register_photo(lamp_studio().surface, photo, without_fallbacks());
  EXPECT_GT(found.quality.outline_asked_share, 0) << found.quality.reason;
  EXPECT_LT(found.quality.outline_asked_share, 0.2);
  EXPECT_NE(found.quality.verdict, Verdict::ok) << found.quality.outline_share;
}

}  // namespace
}  // namespace organbake
