// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/describe.h"

#include <gtest/gtest.h>

#include "support/ramp_volume.h"

namespace organbake {
namespace {

TEST(Describe, NamesThePatientsSidesThatTheAxesRunTowards) {
  const auto orientation = [](const Eigen::Matrix3d& d) {
    return volume_figures(ramp_volume(d)).orientation;
  };
  const Eigen::Vector3d x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();
  EXPECT_EQ(orientation(direction), "LPS");
  direction << -x, -y, z;
  EXPECT_EQ(orientation(direction), "RAS");
  direction << -z, x, -y;
  EXPECT_EQ(orientation(direction), "ILA");
  EXPECT_EQ(orientation(oblique_direction()), "LPS");
}

TEST(Describe, GivesTheFigures) {
  Volume volume = ramp_volume();
  volume.direction.col(1) *= -1;
  const VolumeFigures figures = volume_figures(volume);
  EXPECT_TRUE(figures.left_handed);
  EXPECT_NEAR(figures.oblique_degrees, 0, 1e-6);
  EXPECT_LT((figures.extent_mm - Eigen::Vector3d(4, 5, 9)).norm(), 1e-12);
  EXPECT_LT((figures.min_mm - Eigen::Vector3d(-40, 21.25, 110)).norm(), 1e-12);
  EXPECT_LT((figures.max_mm - Eigen::Vector3d(-36.8, 25, 116)).norm(), 1e-12);
  EXPECT_EQ(figures.range.max, value_range(volume).max);
}

}  // namespace
}  // namespace organbake
