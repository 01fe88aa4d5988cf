// SPDX-License-Identifier: GPL-3.0-or-later
// A CT volume from slices: order, copies, gaps, tilt, phases, frames; and a real tilted head.
#include "dicom/dicom.h"

#include "organbake/volume/read_volume.h"
#include "support/files.h"
#include "support/testing.h"
#include "volume_fixtures.h"

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
  for (std::uint16_t& pixel : other.pixels)
    pixel = static_cast<std::uint16_t>((pixel - 1024 + 500) * 2);
  add("last", other);
  EXPECT_LT(largest_ramp_error(read()), kRounding_hu);
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

TEST(DicomRealData, FolderOfOneSliceInManySyntaxesIsRefused) {
  REQUIRE_SHARED_DATA("dicom/transfer_syntaxes");
  message_of(ExitCode::bad_data, [] { read_volume(shared_data("dicom/transfer_syntaxes")); });
}

namespace fs = std::filesystem;

class DicomKinds : public DicomFolderTest {
 protected:
  std::vector<DicomBytes> stack(int count, double more_hu = 0) const {
    std::vector<DicomBytes> slices;
    for (int k = 0; k < count; ++k) {
      slices.push_back(slice_at(Eigen::Vector3d(5, -8, 20) + 2.5 * k * axes_.col(2), axes_));
      for (std::uint16_t& pixel : slices.back().pixels)
        pixel = static_cast<std::uint16_t>(pixel + more_hu);
    }
    return slices;
  }
  fs::path at(const std::string& name) const { return folder_.path() / name; }

  Eigen::Matrix3d axes_ = oblique_direction();
};

TEST_F(DicomKinds, OneSliceStandsForItsSeries) {
  add_stack({0, 2, 4, 6}, axes_);
  DicomBytes stranger = slice_at({0, 0, 0}, axes_);
  stranger.series_uid = "9.9";
  add("stranger", stranger);
  const Volume volume = read_volume(at("slice2"));
  EXPECT_EQ(volume.size[2], 4);
  EXPECT_LT(largest_ramp_error(volume), kRounding_hu);
}

TEST_F(DicomKinds, SeveralFramesAreTheSameVolumeAsSlices) {
  const std::vector<DicomBytes> slices = stack(5);
  for (std::size_t k = 0; k < slices.size(); ++k) add("slice" + std::to_string(k), slices[k]);
  const Volume classic = read();
  std::vector<DicomBytes> shuffled = {slices[3], slices[0], slices[4], slices[1], slices[2]};
  shuffled[1].intercept = "-2024";  // frames have rescales of their own
  for (std::uint16_t& pixel : shuffled[1].pixels) pixel = static_cast<std::uint16_t>(pixel + 1000);
  write_bytes(at("enhanced.dcm"), enhanced_ct(shuffled));
  const Volume enhanced = read_volume(at("enhanced.dcm"));
  EXPECT_EQ(enhanced.voxels, classic.voxels);
  EXPECT_TRUE(same_grid(enhanced, classic));
  EXPECT_LT(largest_ramp_error(enhanced), kRounding_hu);
}

TEST_F(DicomKinds, AFolderOfOneFileOfSeveralFramesIsReadToo) {
  write_bytes(at("enhanced"), enhanced_ct(stack(3)));
  EXPECT_EQ(read().size[2], 3);
}

TEST_F(DicomKinds, MissingFramesAreTruncated) {
  std::string bytes = enhanced_ct(stack(3));
  write_bytes(at("enhanced"), bytes.substr(0, bytes.size() - 10));
  message_of(ExitCode::bad_data, [&] { read_volume(at("enhanced")); });
}

TEST_F(DicomKinds, ADirectoryOfADiscIsFollowedWhateverTheCaseOfItsNames) {
  const std::vector<DicomBytes> slices = stack(3);
  fs::create_directories(at("dicom/s1"));
  std::vector<std::string> records;
  for (std::size_t k = 0; k < slices.size(); ++k) {
    const std::string name = "i" + std::to_string(k);
    write_bytes(at("dicom/s1/" + name), slices[k].bytes());
    records.push_back(dicom_element(4, 0x1430, "CS", "IMAGE") +
                      dicom_element(4, 0x1500, "CS", "DICOM\\S1\\I" + std::to_string(k)));
  }
  const std::string directory = "1.2.840.10008.1.3.10";
  write_bytes(at("DICOMDIR"), dicom_head(directory) + dicom_sequence(4, 0x1220, records));
  for (const fs::path& path : {at("DICOMDIR"), folder_.path()}) {
    const Volume volume = read_volume(path);
    EXPECT_EQ(volume.size[2], 3);
    EXPECT_LT(largest_ramp_error(volume), kRounding_hu);
  }
  records[1] = dicom_element(4, 0x1500, "CS", "..\\..\\secret");
  write_bytes(at("DICOMDIR"), dicom_head(directory) + dicom_sequence(4, 0x1220, records));
  EXPECT_THAT(error(), HasSubstr("no name of a file"));
}

TEST_F(DicomKinds, FilesThatSystemsLeaveArePassedOver) {
  add_stack({0, 2, 4}, axes_);
  write_bytes(at("README.txt"), "about these slices");
  fs::create_directory(at("more"));
  write_bytes(at("._slice1"),
              std::string("\0\5\x16\7\0\2\0\0Mac OS X        ", 24) + std::string(100, '\0'));
  write_bytes(at("Thumbs.db"), std::string("\xd0\xcf\x11\xe0", 4));
  write_bytes(at(".DS_Store"), "Bud1");
  EXPECT_LT(largest_ramp_error(read()), kRounding_hu);
}

TEST_F(DicomKinds, TimePointsThatShareASeriesAreListedAndChosen) {
  for (int time = 1; time <= 10; ++time) {
    std::vector<DicomBytes> slices = stack(3, time);
    for (std::size_t k = 0; k < slices.size(); ++k) {
      slices[k].temporal_position = std::to_string(time);
      add("t" + std::to_string(time) + "-" + std::to_string(k), slices[k]);
    }
  }
  EXPECT_THAT(error(),
              AllOf(HasSubstr("10 volumes of the same places"),
                    HasSubstr("2: temporal position 2, 3 slices"), HasSubstr("--time 1…10")));
  const Volume first = read({.time = 1}), tenth = read({.time = 10});
  EXPECT_EQ(first.time_points, 10);
  for (std::size_t i = 0; i < first.voxels.size(); ++i)
    ASSERT_EQ(tenth.voxels[i] - first.voxels[i], 9);
  EXPECT_EQ(read({.any_time = true}).voxels, first.voxels);
  EXPECT_THAT(message_of(ExitCode::usage, [&] { read({.time = 11}); }), HasSubstr("no --time 11"));
}

TEST_F(DicomKinds, ReconstructionsThatShareASeriesAreToldApartByTheirKernel) {
  for (const std::string kernel : {"B30f", "B70f"}) {
    std::vector<DicomBytes> slices = stack(3, kernel == "B70f" ? 50 : 0);
    for (std::size_t k = 0; k < slices.size(); ++k) {
      slices[k].kernel = kernel;
      add(kernel + std::to_string(k), slices[k]);
    }
  }
  EXPECT_THAT(error(), HasSubstr("2: reconstruction kernel B70f"));
  EXPECT_LT(largest_ramp_error(read({.time = 1})), kRounding_hu);
}

TEST_F(DicomKinds, FramesOfSeveralTimesAreNotMixed) {
  std::vector<DicomBytes> frames;
  for (int time = 1; time <= 2; ++time) {
    for (DicomBytes slice : stack(3, 10 * (time - 1))) {
      slice.temporal_position = std::to_string(time);
      frames.push_back(slice);
    }
  }
  write_bytes(at("enhanced"), enhanced_ct(frames));
  EXPECT_THAT(error(), HasSubstr("2 volumes of the same places"));
  EXPECT_LT(largest_ramp_error(read({.time = 1})), kRounding_hu);
}

// A real head, scanned with the gantry tilted by 18.5° and in slices of unequal distance.
TEST(DicomRealData, ATiltedHeadIsMadeUprightAndTellsGapsAndTiltAsScanned) {
  REQUIRE_SHARED_DATA("dicom/tilted_head");
  const Volume head = read_volume(shared_data("dicom/tilted_head"));
  EXPECT_THAT(head.warnings, Contains(HasSubstr("tilted by 18.5°")));
  EXPECT_NEAR(head.spacing_mm.z(), 4.0, 0.01);
  EXPECT_GT(value_range(head).max, 1000);  // skull
  EXPECT_NEAR(head.gantry_tilt_degrees, 18.5, 0.01);
  const std::vector<double> gaps = slice_gaps_mm(head);
  ASSERT_EQ(gaps.size(), 27u);
  const auto count = [&](double gap_mm) {
    return std::count_if(gaps.begin(), gaps.end(),
                         [&](double gap) { return std::abs(gap - gap_mm) < 0.01; });
  };
  EXPECT_EQ(count(4.0), 13);
  EXPECT_EQ(count(7.0), 13);
  EXPECT_EQ(count(1.08), 1);
  EXPECT_GE(value_range(head).min, -1024);  // the padding of −1500 is gone
}

}  // namespace
}  // namespace organbake
