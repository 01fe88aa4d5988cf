// SPDX-License-Identifier: GPL-3.0-or-later
#include "mask_stairs.h"

#include <gtest/gtest.h>

#include <cmath>

#include "shape_volumes.h"

namespace organbake {
namespace {

Eigen::Vector3d stairs(const Volume& mask) {
  return stair_height_voxels(mask, 1, bounding_box(mask, 1));
}

TEST(MaskStairs, OfAMaskOnItsOwnGridAreOneVoxelHigh) {
  for (const Shape& shape : {ball({0, 0, 0}, 20), asymmetric_organ()}) {
    const Volume mask = mask_of(shape, grid_around_origin({1, 1, 1}, 56));
    EXPECT_EQ(stairs(mask), Eigen::Vector3d(1, 1, 1));
  }
}

TEST(MaskStairs, OfAResampledMaskAreThoseOfItsFirstGrid) {
  const Volume coarse = mask_of(asymmetric_organ(), grid_around_origin({3, 3, 4}, 60));
  const Shape nearest = [&](const Eigen::Vector3d& world) {
    const Eigen::Vector3d index = coarse.index_from_world(world).array().round();
    for (int axis = 0; axis < 3; ++axis) {
      if (index[axis] < 0 || index[axis] >= coarse.size[axis]) return -1.0;
    }
    const Eigen::Vector3i at = index.cast<int>();
    return coarse.at(at.x(), at.y(), at.z()) - 0.5;
  };
  const Volume resampled = mask_of(nearest, grid_around_origin({0.977, 1.5, 4}, 56));
  EXPECT_EQ(stairs(resampled), Eigen::Vector3d(3, 2, 1));
}

TEST(MaskStairs, ABoxHasNone) {
  const Shape box = [](const Eigen::Vector3d& at) { return 9.6 - at.cwiseAbs().maxCoeff(); };
  EXPECT_EQ(stairs(mask_of(box, grid_around_origin({1, 1, 1}, 30))), Eigen::Vector3d(1, 1, 1));
}

}  // namespace
}  // namespace organbake
