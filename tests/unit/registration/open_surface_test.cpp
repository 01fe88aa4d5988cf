// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "appearance/appearance.h"
#include "lamp_studio.h"
#include "organbake/geometry/refine.h"
#include "organbake/registration/registered_surface.h"
#include "support/meshes.h"

namespace organbake {
namespace {

TEST(BorderDistance, ClosedMeshesHaveNone) {
  EXPECT_TRUE(border_distance_mm(make_icosphere(3)).empty());
  EXPECT_TRUE(border_distance_mm(soup_of(make_icosphere(3))).empty()) << "corners in one place";
}

TEST(BorderDistance, GrowsFromTheCutToThePole) {
  for (const bool loose : {false, true}) {
    TriangleMesh mesh = cut_in_half(make_icosphere(5), Eigen::Vector3d::UnitZ());
    if (loose) mesh = soup_of(mesh);
    const auto distance = border_distance_mm(mesh);
    ASSERT_EQ(distance.size(), mesh.vertices.size());
    // A way along edges zigzags: at most 2/√3 as long as the straight one, and the cut is a
    // triangle's height uneven.
    constexpr double kZigzag = 1.16, kUneven = 0.06;
    for (const Face& face : mesh.faces)
      for (const std::uint32_t v : face) {
        const double arc = std::asin(std::min(1.0, mesh.vertices[v].z()));
        EXPECT_LE(distance[v], kZigzag * arc + kUneven);
        EXPECT_GE(distance[v], arc - 2 * kUneven);
      }
  }
}

class OpenSurface : public testing::Test {
 protected:
  const PosedCamera& camera_ = lamp_studio().cameras[0];
  const Eigen::Vector3d up_ = camera_.camera_from_world.rotation.row(1).transpose();
  const RegisteredSurface surface_{cut_in_half(lamp_studio().surface.mesh(), up_, -20)};
};

TEST_F(OpenSurface, WhatLiesBeyondACutIsNoBackground) {
  ASSERT_TRUE(surface_.open());
  const PhotoToRegister photo = lamp_studio().photo(lamp_studio().plain);
  const PhotoLevel level = photo_pyramid(photo.image, {}, photo.intrinsics, 256, 256).front();
  const ShadingBasis basis({}, 200);
  Prediction p, all;
  const auto draw = [&](const RegisteredSurface& surface, Prediction& drawn) {
    predict(surface, level, object_pose(camera_.camera_from_world, surface.center()), 1, basis,
            basis.first_weights(), {.margin = 8}, drawn);
  };
  draw(surface_, p);
  draw(lamp_studio().surface, all);
  int beside = 0;
  for (const WeightedPixel& pixel : overlap(level, p, 5)) {
    if (p.coverage[p.index(pixel.x, pixel.y)] > 0) continue;
    ++beside;
    EXPECT_LT(all.coverage[all.index(pixel.x, pixel.y)], 0.5f)
        << pixel.x << ", " << pixel.y << ": the organ is there, unseen";
  }
  EXPECT_GT(beside, 200) << "beyond the true outline there is background";
}

TEST_F(OpenSurface, APieceOfTheOrganFindsItsPlace) {
  PhotoToRegister photo = lamp_studio().photo(lamp_studio().plain);
  constexpr double kPiece_mm = 0.5;  // half a pixel: the cut gives nothing away
  photo.start = disturbed(surface_, camera_.camera_from_world, 8, 6, 1);
  RegistrationOptions options;
  options.light = LightModel::camera;  // else the piece is taken for tissue
  const auto found = register_photo(surface_, photo, options);
  EXPECT_LT(mtre_mm(surface_, camera_.camera_from_world, found.camera.camera_from_world),
            kPiece_mm);
}

// Told that the organ ends where the mesh does, the search may still find the place by what is left
// of the true outline; but it never calls another one right.
TEST_F(OpenSurface, AnOrganThatEndsAtTheBorderIsNeverFalselyOk) {
  const RegisteredSurface ending(surface_.mesh(), MeshBorders::outlines);
  EXPECT_FALSE(ending.open());
  PhotoToRegister photo = lamp_studio().photo(lamp_studio().plain);
  constexpr double kRight_mm = 2;  // the false border draws the pose towards it
  RegistrationOptions options;
  options.fallbacks = false;  // what they find is never ok
  options.light = LightModel::camera;
  for (const std::uint64_t seed : {2}) {
    photo.start = disturbed(surface_, camera_.camera_from_world, 8, 6, seed);
    const auto found = register_photo(ending, photo, options);
    const double error_mm =
        mtre_mm(surface_, camera_.camera_from_world, found.camera.camera_from_world);
    EXPECT_TRUE(found.quality.verdict != Verdict::ok || error_mm < kRight_mm) << error_mm << " mm";
  }
}

}  // namespace
}  // namespace organbake
