// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include "dicom_folder_fixture.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;

class DicomKinds : public DicomFolderTest {
 protected:
  std::vector<DicomBytes> stack(int count, double more_hu = 0) const {
    std::vector<DicomBytes> slices;
    for (int k = 0; k < count; ++k) {
      slices.push_back(slice_at(Eigen::Vector3d(5, -8, 20) + 2.5 * k * axes_.col(2), axes_));
      for (std::uint16_t& pixel : slices.back().pixels) {
        pixel = static_cast<std::uint16_t>(pixel + more_hu);
      }
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
  for (std::size_t i = 0; i < first.voxels.size(); ++i) {
    ASSERT_EQ(tenth.voxels[i] - first.voxels[i], 9);
  }
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

}  // namespace
}  // namespace organbake
