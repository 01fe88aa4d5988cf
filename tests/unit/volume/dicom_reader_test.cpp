// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom/dicom_reader.h"

#include <gmock/gmock.h>

#include <cmath>

#include "dicom_folder_fixture.h"
#include "organbake/volume/read_volume.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(DicomFolderTest, SlicesAreSortedByPlaceAndRescaled) {
  for (const Eigen::Matrix3d& axes :
       {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), oblique_direction()}) {
    add_stack({0, 2.5, 5, 7.5}, axes);
    const Volume volume = read();
    EXPECT_EQ(volume.size, (std::array<int, 3>{4, 3, 4}));
    EXPECT_LT((volume.spacing_mm - Eigen::Vector3d(0.75, 0.5, 2.5)).norm(), 1e-5);
    EXPECT_LT(largest_ramp_error(volume), kRounding_hu);
    EXPECT_THAT(volume.warnings, IsEmpty());
  }
}

TEST_F(DicomFolderTest, EverySliceHasItsOwnRescale) {
  add_stack({0, 2, 4}, Eigen::Matrix3d::Identity());
  DicomBytes other = slice_at({5, -8, 26}, Eigen::Matrix3d::Identity());
  other.slope = "0.5";
  other.intercept = "-500";
  for (std::uint16_t& pixel : other.pixels) {
    pixel = static_cast<std::uint16_t>((pixel - 1024 + 500) * 2);
  }
  add("last", other);
  EXPECT_LT(largest_ramp_error(read()), kRounding_hu);
}

TEST_F(DicomFolderTest, OtherFilesArePassedOver) {
  add_stack({0, 2, 4}, Eigen::Matrix3d::Identity());
  write_bytes(folder_.path() / "README.txt", "about these slices");
  std::filesystem::create_directory(folder_.path() / "more");
  EXPECT_EQ(read().size[2], 3);
}

TEST_F(DicomFolderTest, OfSeveralSeriesTheLongestIsTaken) {
  add_stack({0, 2, 4}, Eigen::Matrix3d::Identity());
  for (int k = 0; k < 2; ++k) {
    DicomBytes other = slice_at({5, -8, 20.0 + 2 * k}, Eigen::Matrix3d::Identity());
    other.series_uid = "1.2.4";
    add("other" + std::to_string(k), other);
  }
  const Volume volume = read();
  EXPECT_EQ(volume.size[2], 3);
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("of 2 series, series 7 was taken, ")));
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("most slices (3); not taken: ")));
}

TEST_F(DicomFolderTest, GantryTiltIsShiftedBack) {
  // Slices drift along their own column axis, as a tilted gantry's do.
  const Eigen::Matrix3d axes = oblique_direction();
  add_stack({0, 1.5, 3, 4.5}, axes, 0.3 * axes.col(1));
  const Volume volume = read();
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("tilted by 16.7°")));
  EXPECT_EQ(volume.size[1], 3 + 3);  // 1.35 mm of drift at 0.5 mm a row
  // Inside the original slices' reach the ramp, which interpolation keeps exactly, must be back.
  for (int k = 0; k < 4; ++k) {
    const int first_row = static_cast<int>(std::ceil(k * 1.5 * 0.3 / 0.5));
    for (int i = 0; i < 4; ++i) {
      const double hu = ramp_hu(volume.world_from_index(Eigen::Vector3d(i, first_row, k)));
      EXPECT_NEAR(volume.at(i, first_row, k), hu, kTwiceRounded_hu);
    }
  }
}

TEST_F(DicomFolderTest, UnevenSlicesAreInterpolated) {
  add_stack({0, 2, 4, 7, 9}, Eigen::Matrix3d::Identity());
  const Volume volume = read();
  EXPECT_THAT(volume.warnings,
              Contains(HasSubstr("unevenly spaced (2.00…3.00 mm: 3 × 2.00, 1 × 3.00)")));
  EXPECT_EQ(volume.size[2], 5);  // 0, 2, 4, 6, 8 mm
  EXPECT_LT(largest_ramp_error(volume), kTwiceRounded_hu);
}

TEST_F(DicomFolderTest, GapsTooWideToFillAreRefused) {
  add_stack({0, 2, 4, 12, 14}, Eigen::Matrix3d::Identity());
  EXPECT_THAT(error(), HasSubstr("slices are missing: 8.00 mm between slice3 and slice2"));
}

TEST_F(DicomFolderTest, WhatCannotBeACtVolumeIsRefused) {
  const auto spoiled = [&](auto spoil) {
    add_stack({0, 2, 4}, Eigen::Matrix3d::Identity());
    for (int k = 0; k < 3; ++k) {
      DicomBytes slice = slice_at({5, -8, 20.0 + 2 * k}, Eigen::Matrix3d::Identity());
      spoil(slice);
      add("slice" + std::to_string(3 - k), slice);
    }
    return error();
  };
  EXPECT_THAT(spoiled([](auto& s) { s.modality = "MR"; }), HasSubstr("of modality \"MR\""));
  EXPECT_THAT(spoiled([](auto& s) { s.position.clear(); }), HasSubstr("ImagePositionPatient"));
  EXPECT_THAT(spoiled([](auto& s) { s.pixel_spacing.clear(); }), HasSubstr("PixelSpacing"));
  EXPECT_THAT(spoiled([](auto& s) { s.orientation = "1\\0\\0\\1\\0\\0"; }),
              HasSubstr("perpendicular"));
  EXPECT_THAT(spoiled([](auto& s) { s.pixel_spacing = "0\\1"; }), HasSubstr("not positive"));
  EXPECT_THAT(spoiled([](auto& s) { s.slope = "0"; }), HasSubstr("RescaleSlope"));
  EXPECT_THAT(spoiled([](auto& s) { s.photometric = "MONOCHROME1"; }), HasSubstr("MONOCHROME1"));
  EXPECT_THAT(spoiled([](auto& s) { s.transfer_syntax = "1.2.840.10008.1.2.4.51"; }),
              HasSubstr("lossy JPEG"));
  EXPECT_THAT(spoiled([](auto& s) { s.pixels.resize(5); }), HasSubstr("slice"));
}

TEST_F(DicomFolderTest, ASingleSliceIsNoVolume) {
  add_stack({0}, Eigen::Matrix3d::Identity());
  EXPECT_THAT(error(), HasSubstr("a volume needs at least two"));
}

TEST_F(DicomFolderTest, TruncatedFilesAreErrorsAtEveryLength) {
  add_stack({0, 2, 4}, Eigen::Matrix3d::Identity());
  const std::string whole = slice_at({5, -8, 22}, Eigen::Matrix3d::Identity()).bytes();
  for (std::size_t length = 132; length < whole.size(); length += 7) {
    write_bytes(folder_.path() / "slice2", whole.substr(0, length));
    try {
      // A slice cut in its header is passed over, which leaves a gap that is told.
      EXPECT_THAT(read().warnings, ::testing::Not(IsEmpty())) << length;
    } catch (const BadDataError& error) {
      EXPECT_THAT(error.what(), HasSubstr(folder_.path().string())) << length;
    }
  }
}

TEST(DicomRealData, AbdomenDecodesToHounsfieldUnits) {
  REQUIRE_SHARED_DATA("ct/abdomen/example_ct_dicom");
  const Volume& ct = dicom_abdomen();  // JPEG 2000 lossless
  EXPECT_EQ(ct.size, (std::array<int, 3>{512, 512, 20}));
  EXPECT_EQ(ct.spacing_mm, Eigen::Vector3d(0.9765625, 0.9765625, 2));
  EXPECT_EQ(ct.direction, Eigen::Matrix3d(Eigen::Matrix3d::Identity()));
  EXPECT_EQ(value_range(ct).min, -1024);
  EXPECT_EQ(value_range(ct).max, 1839);
  EXPECT_THAT(ct.warnings, IsEmpty());
}

TEST(DicomRealData, TiltedHeadIsMadeUpright) {
  REQUIRE_SHARED_DATA("dicom/tilted_head");
  const Volume head = read_volume(shared_data("dicom/tilted_head"));
  EXPECT_THAT(head.warnings, Contains(HasSubstr("tilted by 18.5°")));
  EXPECT_THAT(head.warnings, Contains(HasSubstr("1.08…7.00 mm: 1 × 1.08, 13 × 4.00, 13 × 7.00")));
  EXPECT_NEAR(head.spacing_mm.z(), 4.0, 0.01);
  EXPECT_GT(value_range(head).max, 1000);  // skull
}

TEST(DicomRealData, FolderOfOneSliceInManySyntaxesIsRefused) {
  REQUIRE_SHARED_DATA("dicom/transfer_syntaxes");
  message_of(ExitCode::bad_data, [] { read_volume(shared_data("dicom/transfer_syntaxes")); });
}

}  // namespace
}  // namespace organbake
