// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/mask_check.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <limits>

#include "organbake/volume/read_volume.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int kFirstOrganSlice = 25;

// 40 slices of air with an organ of 50 HU in ten of them, beside bone.
Volume small_ct() {
  Volume ct;
  ct.size = {16, 16, 40};
  ct.spacing_mm = {2, 2, 3};
  ct.voxels.assign(16 * 16 * 40, -1000);
  for (int k = kFirstOrganSlice; k < kFirstOrganSlice + 10; ++k) {
    for (int j = 4; j < 12; ++j) {
      for (int i = 4; i < 12; ++i) {
        ct.voxels[std::size_t(k * 16 + j) * 16 + i] = static_cast<std::int16_t>(45 + (i + j) % 11);
      }
    }
  }
  return ct;
}

// The organ's mask, cropped to its own slices.
Volume cropped_mask(const Volume& ct) {
  Volume mask = ct;
  mask.size[2] = 10;
  mask.voxels.resize(16 * 16 * 10);
  for (std::size_t v = 0; v < mask.voxels.size(); ++v) {
    mask.voxels[v] = ct.voxels[v + 256 * kFirstOrganSlice] > 0 ? 5 : 0;
  }
  mask.origin_mm = ct.world_from_index({0, 0, kFirstOrganSlice});
  return mask;
}

MaskCheckOptions label_five() {
  MaskCheckOptions options;
  options.label = 5;
  return options;
}

TEST(MaskCheck, DefaultsAreValidAndBoundsAreChecked) {
  EXPECT_NO_THROW(MaskCheckOptions().check());
  const auto spoiled = [](auto spoil) {
    MaskCheckOptions options;
    spoil(options);
    message_of(ExitCode::usage, [&] { options.check(); });
  };
  spoiled([](auto& o) { o.soft_tissue_min_hu = 400; });
  spoiled([](auto& o) { o.min_soft_tissue_share = 1.5; });
  spoiled([](auto& o) { o.max_deviation_hu = 0; });
  spoiled([](auto& o) { o.max_deviation_hu = std::numeric_limits<double>::quiet_NaN(); });
}

TEST(MaskCheck, AMaskInItsPlaceIsPlausible) {
  const Volume ct = small_ct();
  const MaskCheck check = check_mask(ct, cropped_mask(ct), label_five());
  EXPECT_TRUE(check.plausible);
  EXPECT_FALSE(check.grids_equal);
  EXPECT_EQ(check.overlap_share, 1);
  EXPECT_EQ(check.fit.soft_tissue_share, 1);
  EXPECT_THAT(check.message, IsEmpty());
}

// Gas below the organ: moved onto it the label would fit, but the organ's own label no longer.
TEST(MaskCheck, AGutFullOfGasIsNotMovedWhereTheOtherLabelsFit) {
  const Volume ct = small_ct();
  Volume mask = ct;
  constexpr int kFirst = kFirstOrganSlice - 10;
  mask.size[2] = 20;
  mask.voxels.resize(16 * 16 * 20);
  for (std::size_t v = 0; v < mask.voxels.size(); ++v)
    mask.voxels[v] = ct.voxels[v % 2560 + 256 * kFirstOrganSlice] <= 0 ? 0 : v < 2560 ? 7 : 5;
  mask.origin_mm = ct.world_from_index({0, 0, kFirst});
  MaskCheckOptions gut;
  gut.label = 7;
  const MaskCheck check = check_mask(ct, mask, gut);
  EXPECT_FALSE(check.plausible);
  EXPECT_FALSE(check.better);
  EXPECT_THAT(check.message, HasSubstr("label 7 lies on soft tissue"));
  EXPECT_THAT(check.message, HasSubstr("That is right for bone, lung or gut"));
  std::replace(mask.voxels.begin(), mask.voxels.end(), std::int16_t{5}, std::int16_t{0});
  EXPECT_TRUE(check_mask(ct, mask, gut).better);
}

TEST(MaskCheck, ACropThatKeptTheScansOriginIsFoundAndItsPlaceNamed) {
  const Volume ct = small_ct();
  Volume mask = cropped_mask(ct);
  mask.origin_mm = ct.origin_mm;
  const MaskCheck check = check_mask(ct, mask, label_five());
  EXPECT_FALSE(check.plausible);
  ASSERT_TRUE(check.better);
  EXPECT_EQ(check.better->slices, kFirstOrganSlice);
  EXPECT_LT((check.better->shift_world_mm - Eigen::Vector3d(0, 0, 75)).norm(), 1e-9);
  EXPECT_THAT(check.message, HasSubstr("Its header repeats the CT's origin"));
  EXPECT_THAT(check.message, HasSubstr("(0.0, 0.0, 75.0) mm (LPS)"));
  mask.origin_mm += check.better->shift_world_mm;
  EXPECT_TRUE(check_mask(ct, mask, label_five()).plausible);
}

TEST(MaskCheck, AMaskOfAnotherPlaceGetsBothPlacesTold) {
  const Volume ct = small_ct();
  Volume mask = cropped_mask(ct);
  mask.origin_mm.x() += 5000;
  const MaskCheck check = check_mask(ct, mask, label_five());
  EXPECT_EQ(check.overlap_share, 0);
  EXPECT_FALSE(check.better);
  EXPECT_THAT(check.message, HasSubstr("no voxel of label 5 lies inside the CT"));
}

TEST(MaskCheck, OnTheCtsOwnGridNoMoveIsProposed) {
  const Volume ct = small_ct();
  Volume mask = ct;
  for (std::size_t v = 0; v < mask.voxels.size(); ++v) mask.voxels[v] = v < 5000 ? 5 : 0;
  const MaskCheck check = check_mask(ct, mask, label_five());
  EXPECT_TRUE(check.grids_equal);
  EXPECT_FALSE(check.plausible);
  EXPECT_FALSE(check.better);
  EXPECT_THAT(check.message, HasSubstr("right for bone, lung or gut"));
}

TEST(MaskCheck, AnAbsentLabelIsRefusedWithThoseThatAreThere) {
  const Volume ct = small_ct();
  MaskCheckOptions options;
  options.label = 6;
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { check_mask(ct, cropped_mask(ct), options); }),
              HasSubstr("no label 6; it holds 5"));
}

TEST(MaskCheckRealData, TheAbdomenMasksWrongOriginIsFound) {
  REQUIRE_SHARED_DATA("ct/abdomen/example_seg.nii.gz");
  const Volume ct = read_volume(shared_data("ct/abdomen/example_ct.nii.gz"));
  Volume mask = read_volume(shared_data("ct/abdomen/example_seg.nii.gz"));
  const MaskCheck check = check_mask(ct, mask, label_five());
  EXPECT_FALSE(check.plausible);
  ASSERT_TRUE(check.better);
  EXPECT_EQ(check.better->slices, 82);  // the data's README: slices 82…111 of the CT
  mask.origin_mm += check.better->shift_world_mm;
  const MaskCheck moved = check_mask(ct, mask, label_five());
  EXPECT_TRUE(moved.plausible);
  EXPECT_LT(moved.fit.deviation_hu, 20);  // a liver, not a mixture
}

TEST(MaskCheckRealData, TheDicomMaskSitsOnItsLiver) {
  REQUIRE_SHARED_DATA("ct/abdomen/example_ct_dicom");
  const Volume& ct = dicom_abdomen();
  const Volume mask = read_volume(shared_data("ct/abdomen/example_seg_dicom.nii.gz"));
  const MaskCheck check = check_mask(ct, mask, label_five());
  EXPECT_TRUE(check.plausible) << check.message;
  EXPECT_NEAR(check.fit.mean_hu, 90, 20);  // liver in the portal phase
}

}  // namespace
}  // namespace organbake
