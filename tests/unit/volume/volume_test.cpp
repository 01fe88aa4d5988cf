// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/volume.h"

#include <gmock/gmock.h>

#include <limits>

#include "grid/affine_grid.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

constexpr double kRoundOff_mm = 1e-9;

TEST(Volume, MapsIndicesToTheWorldAndBack) {
  const Volume volume = ramp_volume(oblique_direction());
  const Eigen::Vector3d index(3.25, -1, 2);
  const Eigen::Vector3d world = volume.world_from_index(index);
  EXPECT_LT((volume.index_from_world(world) - index).norm(), kRoundOff_mm);
}

TEST(Volume, KnowsItsRangeAndLabels) {
  Volume volume = ramp_volume();
  volume.voxels.assign(60, 0);
  volume.voxels[3] = -32768;
  volume.voxels[7] = volume.voxels[8] = 32767;
  EXPECT_EQ(value_range(volume).min, -32768);
  EXPECT_EQ(value_range(volume).max, 32767);
  const auto labels = count_labels(volume);
  ASSERT_EQ(labels.size(), 2u);
  EXPECT_EQ(labels[1].label, 32767);
  EXPECT_EQ(labels[1].voxels, 2u);
}

TEST(Volume, ChecksAcceptWhatIsSound) {
  EXPECT_NO_THROW(check_volume(ramp_volume(), "v"));
  EXPECT_NO_THROW(check_volume(ramp_volume(oblique_direction()), "v"));
  Eigen::Matrix3d mirrored = oblique_direction();
  mirrored.col(1) *= -1;
  EXPECT_NO_THROW(check_volume(ramp_volume(mirrored), "v"));
}

TEST(Volume, ChecksRefuseWhatIsNot) {
  const auto spoiled = [](auto spoil) {
    Volume volume = ramp_volume();
    spoil(volume);
    return message_of(ExitCode::bad_data, [&] { check_volume(volume, "scan"); });
  };
  EXPECT_THAT(spoiled([](Volume& v) { v.size[1] = 0; }), HasSubstr("scan: a volume of 5×0×3"));
  EXPECT_THAT(spoiled([](Volume& v) { v.voxels.pop_back(); }), HasSubstr("59 values"));
  EXPECT_THAT(spoiled([](Volume& v) { v.spacing_mm[2] = 0; }), HasSubstr("spacing along axis 2"));
  EXPECT_THAT(spoiled([](Volume& v) { v.spacing_mm[2] = -3; }), HasSubstr("must be in"));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(spoiled([&](Volume& v) { v.spacing_mm[0] = nan; }), HasSubstr("spacing"));
  EXPECT_THAT(spoiled([](Volume& v) { v.spacing_mm[0] = 5e-324; }), HasSubstr("must be in"));
  EXPECT_THAT(spoiled([](Volume& v) { v.origin_mm[1] = 1e300; }), HasSubstr("within 1e9 mm"));
  EXPECT_THAT(spoiled([&](Volume& v) { v.origin_mm[0] = nan; }), HasSubstr("not finite"));
  EXPECT_THAT(spoiled([](Volume& v) { v.direction(0, 1) = 0.1; }), HasSubstr("perpendicular"));
}

TEST(Volume, GridsAreTheSameByPlaceNotByHeader) {
  const Volume volume = ramp_volume();
  Volume other = volume;
  EXPECT_TRUE(same_grid(volume, other));
  other.origin_mm.x() += 0.1;
  EXPECT_FALSE(same_grid(volume, other));
  other = volume;
  other.spacing_mm.z() *= 1.01;  // 0.06 mm at the far end
  EXPECT_FALSE(same_grid(volume, other));
}

TEST(Grid, SmallShearIsTakenOutAndALargeOneRefused) {
  Volume volume;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  axes(0, 1) = 1e-5;
  set_grid(volume, axes, Eigen::Vector3d::Zero(), "v");
  const Eigen::Matrix3d square = volume.direction.transpose() * volume.direction;
  EXPECT_LT((square - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  axes(0, 1) = 0.1;
  EXPECT_THAT(message_of(ExitCode::bad_data,
                         [&] { set_grid(volume, axes, Eigen::Vector3d::Zero(), "scan"); }),
              HasSubstr("scan: the volume's axes are sheared by 5.7"));
}

TEST(Grid, KeepsALeftHandedDirection) {
  Volume volume;
  Eigen::Matrix3d axes = oblique_direction();
  axes.col(0) *= -2;
  set_grid(volume, axes, Eigen::Vector3d::Zero(), "v");
  EXPECT_NEAR(volume.spacing_mm[0], 2, kRoundOff_mm);
  EXPECT_LT((volume.direction.col(0) * 2 - axes.col(0)).norm(), kRoundOff_mm);
}

TEST(Grid, SizesAreBoundedBeforeMemoryIsTaken) {
  EXPECT_EQ(checked_voxel_count({512, 512, 300}, "v"), 512u * 512 * 300);
  for (const std::array<std::int64_t, 3>& size : {std::array<std::int64_t, 3>{0, 1, 1},
                                                  {-5, 1, 1},
                                                  {70000, 1, 1},
                                                  {60000, 60000, 1},
                                                  {std::int64_t{1} << 62, 1, 1}}) {
    message_of(ExitCode::bad_data, [&] { checked_voxel_count(size, "v"); });
  }
}

}  // namespace
}  // namespace organbake
