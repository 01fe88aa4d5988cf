// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include "support/ramp_volume.h"
#include "volume/read_volume.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

// A grid of 24³ voxels of 1 mm whose label 3 is a half-ball off the centre.
Volume labelled(const Eigen::Matrix3d& direction, const Eigen::Vector3d& origin, double spacing,
                int size) {
  Volume volume;
  volume.size = {size, size, size};
  volume.spacing_mm.setConstant(spacing);
  volume.direction = direction;
  volume.origin_mm = origin;
  for (int k = 0; k < size; ++k) {
    for (int j = 0; j < size; ++j) {
      for (int i = 0; i < size; ++i) {
        const Eigen::Vector3d world = volume.world_from_index(Eigen::Vector3d(i, j, k));
        const bool inside = world.norm() < 8 && world.x() > -2.3 && world.y() < 3.4;
        volume.voxels.push_back(inside ? 3 : 0);
      }
    }
  }
  return volume;
}

TEST(ResampleMask, TheSameGridIsCopied) {
  const Volume mask = labelled(Eigen::Matrix3d::Identity(), {-12, -12, -12}, 1, 24);
  EXPECT_EQ(resample_mask(mask, mask).voxels, mask.voxels);
}

TEST(ResampleMask, MirroredAndTurnedGridsGiveTheSameObject) {
  const Volume grid = labelled(Eigen::Matrix3d::Identity(), {-12, -12, -12}, 1, 24);
  Eigen::Matrix3d mirrored = Eigen::Matrix3d::Identity();
  mirrored(1, 1) = -1;
  const Volume left_handed = labelled(mirrored, {-12, 11, -12}, 1, 24);
  EXPECT_EQ(resample_mask(left_handed, grid).voxels, grid.voxels);

  // A fine oblique mask: only voxels cut by the surface may differ.
  const Volume fine =
      labelled(oblique_direction(), oblique_direction() * -12 * Eigen::Vector3d::Ones(), 0.25, 97);
  const Volume resampled = resample_mask(fine, grid);
  std::size_t different = 0;
  for (std::size_t v = 0; v < grid.voxels.size(); ++v) {
    different += resampled.voxels[v] != grid.voxels[v];
  }
  constexpr std::size_t kMostCutVoxels = 60;  // of about 900, each within 0.22 mm of the surface
  EXPECT_LT(different, kMostCutVoxels);
  EXPECT_GT(count_labels(resampled).at(0).voxels, 800u);
}

TEST(ResampleMask, WhatTheMaskDoesNotCoverIsBackground) {
  const Volume grid = labelled(Eigen::Matrix3d::Identity(), {-12, -12, -12}, 1, 24);
  Volume half = labelled(Eigen::Matrix3d::Identity(), {-12, -12, 0}, 1, 24);
  const Volume resampled = resample_mask(half, grid);
  for (std::size_t v = 0; v < 12 * 24 * 24; ++v) ASSERT_EQ(resampled.voxels[v], 0);
}

TEST(ResampleMask, GridsApartAreRefusedWithBothPlaces) {
  const Volume grid = ramp_volume();
  const Volume mask = ramp_volume(Eigen::Matrix3d::Identity(), {400, 25, 110});
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { resample_mask(mask, grid); }),
              HasSubstr("the mask covers 400.0, 25.0, 110.0 …"));
}

TEST(ResampleMaskRealData, LiverMaskComesOntoTheDicomGrid) {
  REQUIRE_SHARED_DATA("ct/abdomen/example_ct_dicom");
  const Volume& ct = dicom_abdomen();
  const Volume mask = read_volume(shared_data("ct/abdomen/example_seg_dicom.nii.gz"));
  const Volume resampled = resample_mask(mask, ct);
  EXPECT_TRUE(same_grid(resampled, ct));
  // The same grid with its rows mirrored: no voxel is lost.
  const auto before = count_labels(mask), after = count_labels(resampled);
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(before[i].voxels, after[i].voxels);
}

}  // namespace
}  // namespace organbake
