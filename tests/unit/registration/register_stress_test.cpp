// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "lamp_studio.h"
#include "organbake/core/error.h"

namespace organbake {
namespace {

PhotoToRegister grey(int size, int value) {
  PhotoToRegister photo;
  photo.image = Rgb8Image(size, size);
  std::fill(photo.image.pixels.begin(), photo.image.pixels.end(), value);
  photo.intrinsics = {size, size, 1.5 * size, 1.5 * size, size / 2.0, size / 2.0};
  return photo;
}

RigidTransform in_front() { return lamp_studio().cameras[0].camera_from_world; }

TEST(RegisterStress, PhotographsThatTellNothingFail) {
  RegistrationOptions one_light;  // each searches all round
  one_light.light = LightModel::camera;
  EXPECT_EQ(register_photo(lamp_studio().surface, grey(32, 128), one_light).quality.verdict,
            Verdict::failed);
  for (const int value : {0, 128, 255}) {
    PhotoToRegister photo = grey(value == 128 ? 32 : 16, value);
    photo.start = in_front();
    const auto found = register_photo(lamp_studio().surface, photo, {});
    EXPECT_EQ(found.quality.verdict, Verdict::failed) << value;
    EXPECT_FALSE(found.quality.reason.empty());
  }
}

TEST(RegisterStress, TinyPhotographsFail) {
  RegistrationOptions one_light;
  one_light.light = LightModel::camera;
  for (const int size : {1, 8, 9}) {
    PhotoToRegister photo = grey(size, 100);
    *photo.image.at(size / 2, size / 2) = 200;
    EXPECT_NE(register_photo(lamp_studio().surface, photo, one_light).quality.verdict, Verdict::ok);
    photo.start = in_front();
    EXPECT_NE(register_photo(lamp_studio().surface, photo, {}).quality.verdict, Verdict::ok);
  }
}

// A start that is no start: the search may find the organ all the same, but may not take another
// place for it.
void expect_right_or_not_ok(const PhotoToRegister& photo) {
  RegistrationOptions options;
  options.light = LightModel::camera;
  const auto found = register_photo(lamp_studio().surface, photo, options);
  const double error_mm =
      mtre_mm(lamp_studio().surface, in_front(), found.camera.camera_from_world);
  EXPECT_EQ(found.quality.verdict == Verdict::ok, error_mm < 1) << error_mm << " mm";
}

TEST(RegisterStress, AMeshBehindTheCameraIsFoundOrFails) {
  PhotoToRegister photo = lamp_studio().photo(lamp_studio().plain);
  photo.start = in_front();
  photo.start->translation.z() -= 2000;
  expect_right_or_not_ok(photo);
  // Where the organ does not stand out from its ground there is nothing to go by.
  for (std::size_t i = 0; i < photo.image.pixels.size(); ++i)
    photo.image.pixels[i] = static_cast<std::uint8_t>(40 + (i * 2654435761u >> 7) % 120);
  EXPECT_EQ(register_photo(lamp_studio().surface, photo, {}).quality.verdict, Verdict::failed);
}

TEST(RegisterStress, ACameraInsideTheMeshIsFoundOrNotOk) {
  PhotoToRegister photo = lamp_studio().photo(lamp_studio().plain);
  photo.start = in_front();
  photo.start->translation -= *photo.start * lamp_studio().surface.center();
  expect_right_or_not_ok(photo);
}

TEST(RegisterStress, OneTriangleEnds) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {50, 0, 0}, {0, 50, 0}};
  mesh.faces = {{0, 1, 2}};
  const RegisteredSurface surface(mesh);
  const PhotoToRegister photo = lamp_studio().photo(lamp_studio().plain);
  EXPECT_NE(register_photo(surface, photo, {}).quality.verdict, Verdict::ok);
  mesh.vertices[2] = {100, 0, 0};  // and one without area
  RegistrationOptions one_light;
  one_light.light = LightModel::camera;
  EXPECT_NE(register_photo(RegisteredSurface(mesh), photo, one_light).quality.verdict, Verdict::ok);
}

TEST(RegisterStress, BadInputIsRefused) {
  PhotoToRegister photo = lamp_studio().photo(lamp_studio().plain);
  photo.intrinsics.fx = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(register_photo(lamp_studio().surface, photo, {}), BadDataError);
  photo = lamp_studio().photo(lamp_studio().plain);
  photo.intrinsics.width += 1;
  EXPECT_THROW(register_photo(lamp_studio().surface, photo, {}), BadDataError);
  photo = lamp_studio().photo(lamp_studio().plain);
  photo.mask = Rgb8Image(3, 3);
  EXPECT_THROW(register_photo(lamp_studio().surface, photo, {}), BadDataError);
  EXPECT_THROW(RegisteredSurface{TriangleMesh{}}, BadDataError);
}

TEST(RegistrationOptions, CheckThemselves) {
  RegistrationOptions().check();
  RegistrationOptions options;
  options.finest_side_px = 63;
  EXPECT_THROW(options.check(), UsageError);
  options = {};
  options.outer_iterations = 0;
  EXPECT_THROW(options.check(), UsageError);
  options = {};
  options.solver_iterations = 101;
  EXPECT_THROW(options.check(), UsageError);
  options = {};
  options.light_direction.setZero();
  EXPECT_THROW(options.check(), UsageError);
}

}  // namespace
}  // namespace organbake
