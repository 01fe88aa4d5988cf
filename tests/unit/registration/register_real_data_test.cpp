// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numbers>

#include "formats/mesh_files.h"
#include "formats/photo.h"
#include "lamp_studio.h"

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
TEST(RegisterRealData, RenderedLiverFromAStartFarOff) {
  if (!fs::exists(shared_data("rendered_liver"))) {
    GTEST_SKIP() << "REAL DATA MISSING: " << shared_data("rendered_liver");
  }
  const RegisteredSurface surface(read_mesh(shared_data("rendered_liver/liver-H07.ply")));
  PhotoToRegister photo;
  photo.image = read_photo(shared_data("rendered_liver/synthetic-left.png"));
  photo.intrinsics = {1920, 1080, 2012.186314, 2017.966019, 944.7173708, 617.1093984};
  const RigidTransform truth =
      rigid(read_matrix(shared_data("rendered_liver/camera_to_world.txt"))).inverse() *
      rigid(read_matrix(shared_data("rendered_liver/model_to_world.txt")));
  RegistrationOptions options;
  options.light = LightModel::estimated;
  options.finest_side_px = 500;
  for (const std::uint64_t seed : {1, 2}) {
    photo.start = disturbed(surface, truth, 20, 15, seed);
    const auto found = register_photo(surface, photo, options);
    EXPECT_LT(mtre_mm(surface, truth, found.camera.camera_from_world), 1) << "seed " << seed;
    const Eigen::AngleAxisd turn(found.camera.camera_from_world.rotation *
                                 truth.rotation.transpose());
    EXPECT_LT(turn.angle() * 180 / std::numbers::pi, 0.5) << "seed " << seed;
    EXPECT_EQ(found.quality.verdict, Verdict::ok) << found.quality.reason;
  }
}

}  // namespace
}  // namespace organbake
