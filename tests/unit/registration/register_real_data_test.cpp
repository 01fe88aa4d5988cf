// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numbers>
#include <optional>

#include "lamp_studio.h"
#include "organbake/formats/mesh_files.h"
#include "organbake/formats/photo.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

fs::path shared_data(const std::string& below) {
  return fs::path(ORGANBAKE_SHARED_DATA) / "registration" / below;
}

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
    if (!fs::exists(shared_data("rendered_liver"))) {
      GTEST_SKIP() << "REAL DATA MISSING: " << shared_data("rendered_liver");
    }
    surface_.emplace(read_mesh(shared_data("rendered_liver/liver-H07.ply")));
    photo_.image = read_photo(shared_data("rendered_liver/synthetic-left.png"));
    photo_.intrinsics = {1920, 1080, 2012.186314, 2017.966019, 944.7173708, 617.1093984};
    truth_ = rigid(read_matrix(shared_data("rendered_liver/camera_to_world.txt"))).inverse() *
             rigid(read_matrix(shared_data("rendered_liver/model_to_world.txt")));
  }

  RegisteredPhoto expect_found() const {
    RegistrationOptions options;
    options.light = LightModel::estimated;
    options.finest_side_px = 500;
    const auto found = register_photo(*surface_, photo_, options);
    EXPECT_LT(mtre_mm(*surface_, truth_, found.camera.camera_from_world), 1);
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
