// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <filesystem>

#include "organbake/isosurface/isosurface.h"
#include "organbake/isosurface/label_surface.h"
#include "organbake/volume/read_volume.h"
#include "shape_volumes.h"

namespace organbake {
namespace {

std::filesystem::path shared_data(const std::string& below) {
  return std::filesystem::path(ORGANBAKE_SHARED_DATA) / below;
}

#define REQUIRE_SHARED_DATA(below)                               \
  if (!std::filesystem::exists(shared_data(below))) {            \
    GTEST_SKIP() << "REAL DATA MISSING: " << shared_data(below); \
  }

struct Organ {
  const char* mask;
  int label;
  double millilitres;  // voxels × voxel volume, the data's README
};

class RealOrgan : public ::testing::TestWithParam<Organ> {};

TEST_P(RealOrgan, KeepsItsVolume) {
  const Organ organ = GetParam();
  REQUIRE_SHARED_DATA(organ.mask);
  IsosurfaceOptions options;
  options.label = organ.label;
  const Isosurface surface = extract_label_surface(read_volume(shared_data(organ.mask)), options);
  expect_closed_and_sound(surface.mesh);
  constexpr double kTolerance = 0.002;  // 0.1 % is promised, the README's figures are rounded
  EXPECT_NEAR(signed_volume(surface.mesh) / 1000 / organ.millilitres, 1, kTolerance);
}

INSTANTIATE_TEST_SUITE_P(Abdomen, RealOrgan,
                         ::testing::Values(Organ{"ct/abdomen/example_seg.nii.gz", 5, 1043},
                                           Organ{"ct/abdomen/example_seg.nii.gz", 1, 255},
                                           Organ{"ct/abdomen/example_seg_dicom.nii.gz", 5, 699.4}));

TEST(RealSurface, OfTheAbdomensSkinIsOneClosedPiece) {
  REQUIRE_SHARED_DATA("ct/abdomen/example_ct.nii.gz");
  const Volume ct = read_volume(shared_data("ct/abdomen/example_ct.nii.gz"));
  const Isosurface surface = extract_isosurface(ct, {});
  expect_closed_and_sound(surface.mesh);
  EXPECT_EQ(surface.components_kept, 1u);
  EXPECT_GT(surface.components_found, 1u);
}

TEST(RealSurface, OfTheLungsSegmentationIsClosed) {
  REQUIRE_SHARED_DATA("ct/lung/3DCT_lung_followup_segmentation.mha");
  IsosurfaceOptions options;
  options.label = 137;
  const Volume mask = read_volume(shared_data("ct/lung/3DCT_lung_followup_segmentation.mha"));
  expect_closed_and_sound(extract_label_surface(mask, options).mesh);
}

}  // namespace
}  // namespace organbake
