// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <optional>

#include "lamp_studio.h"
#include "organbake/core/error.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/formats/photo.h"
#include "support/places.h"

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
      lamp_studio().surface.mean_distance_mm(in_front(), found.camera.camera_from_world);
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
  EXPECT_THROW(RegisteredSurface{mesh}, BadDataError);
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
}

namespace fs = std::filesystem;

Eigen::Matrix4d read_matrix(const fs::path& path) {
  std::ifstream file(path);
  Eigen::Matrix4d m;
  for (int i = 0; i < 16; ++i) file >> m(i / 4, i % 4);
  return m;
}

RigidTransform rigid(const Eigen::Matrix4d& m) {
  return {m.topLeftCorner<3, 3>(), m.topRightCorner<3, 1>()};
}

// A rendering of VTK's with a lamp at the camera that does not fall off, on a cluttered background,
// partly out of the picture; pieces of the mesh are inside out.
class RegisterRenderedLiver : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(shared_data("registration/rendered_liver"))) {
      GTEST_SKIP() << "REAL DATA MISSING: " << shared_data("registration/rendered_liver");
    }
    surface_.emplace(read_mesh(shared_data("registration/rendered_liver/liver-H07.ply")));
    photo_.image = read_photo(shared_data("registration/rendered_liver/synthetic-left.png"));
    photo_.intrinsics = {1920, 1080, 2012.186314, 2017.966019, 944.7173708, 617.1093984};
    truth_ = rigid(read_matrix(shared_data("registration/rendered_liver/camera_to_world.txt")))
                 .inverse() *
             rigid(read_matrix(shared_data("registration/rendered_liver/model_to_world.txt")));
  }

  RegisteredPhoto expect_found() const {
    RegistrationOptions options;
    options.light = LightModel::estimated;
    options.finest_side_px = 500;
    const auto found = register_photo(*surface_, photo_, options);
    EXPECT_LT(surface_->mean_distance_mm(truth_, found.camera.camera_from_world), 1);
    const Eigen::AngleAxisd turn(found.camera.camera_from_world.rotation *
                                 truth_.rotation.transpose());
    EXPECT_LT(turn.angle() * 180 / std::numbers::pi, 0.5);
    return found;
  }

  std::optional<RegisteredSurface> surface_;
  PhotoToRegister photo_;
  RigidTransform truth_;
};

TEST_F(RegisterRenderedLiver, FromAStartFarOff) {
  photo_.start = disturbed(*surface_, truth_, 20, 15, 1);
  const RegisteredPhoto found = expect_found();
  EXPECT_EQ(found.quality.verdict, Verdict::ok) << found.quality.reason;
}

// The clutter explains a little of many wrong poses; the organ's own pixels only of the right one.
TEST_F(RegisterRenderedLiver, WithoutAnyStart) { expect_found(); }

}  // namespace
}  // namespace organbake
