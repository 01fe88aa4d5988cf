// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/label_box.h"

#include <gtest/gtest.h>

namespace organbake {
namespace {

// Label 3 in two voxels of 11 × 11 × 11, whose first lies at (−5, −5, −5) mm.
Volume two_voxels() {
  Volume mask;
  mask.size = {11, 11, 11};
  mask.origin_mm = {-5, -5, -5};
  mask.voxels.assign(11 * 11 * 11, 0);
  mask.voxels[(6 * 11 + 4) * 11 + 2] = 3;
  mask.voxels[(10 * 11 + 1) * 11 + 3] = 3;
  return mask;
}

TEST(LabelBox, HoldsTheLabelAlone) {
  const Volume mask = two_voxels();
  EXPECT_EQ(bounding_box(mask, 2).label_voxels, 0u);
  const LabelBox box = bounding_box(mask, 3);
  EXPECT_EQ(box.label_voxels, 2u);
  EXPECT_EQ(box.first, (std::array<int, 3>{2, 1, 6}));
  EXPECT_EQ(box.size, (std::array<int, 3>{2, 4, 5}));
}

TEST(LabelBox, RegionAroundItReachesTwoVoxelsOnAlongTurnedAxes) {
  Volume mask = two_voxels();
  mask.direction.col(0) = -Eigen::Vector3d::UnitX();
  const Region region = region_around(mask, bounding_box(mask, 3));
  EXPECT_EQ(region.min_mm, Eigen::Vector3d(-5 - 5, -5 + 1 - 2, -5 + 6 - 2));
  EXPECT_EQ(region.max_mm, Eigen::Vector3d(-5 - 0, -5 + 4 + 2, -5 + 10 + 2));
}

}  // namespace
}  // namespace organbake
