// SPDX-License-Identifier: GPL-3.0-or-later
#include "files/metaimage_reader.h"

#include <gmock/gmock.h>

#include "organbake/core/temporary_folder.h"
#include "organbake/volume/read_volume.h"
#include "organbake/volume/write_volume.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

constexpr double kRounding_hu = 0.5 + 1e-9;

std::string header(const std::string& more, const std::string& last = "ElementDataFile = LOCAL\n") {
  return "ObjectType = Image\nNDims = 3\nDimSize = 5 4 3\nElementSpacing = 0.8 1.25 3\n"
         "Offset = -40 25 110\nElementType = MET_SHORT\n" +
         more + last;
}

class MetaImage : public ::testing::Test {
 protected:
  Volume read(const std::string& bytes) {
    write_bytes(file_, bytes);
    return read_volume(file_);
  }
  std::string error(const std::string& bytes) {
    return message_of(ExitCode::bad_data, [&] { read(bytes); });
  }

  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "scan.mha";
  std::string raw_ = voxel_bytes(ramp_volume());
};

TEST_F(MetaImage, WhatIsWrittenIsReadBackExactly) {
  Eigen::Matrix3d mirrored = oblique_direction();
  mirrored.col(1) *= -1;
  for (const Eigen::Matrix3d& direction :
       {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), oblique_direction(), mirrored}) {
    const Volume truth = ramp_volume(direction);
    write_metaimage(file_, truth);
    const Volume volume = read_volume(file_);
    EXPECT_EQ(volume.voxels, truth.voxels);
    EXPECT_EQ(volume.spacing_mm, truth.spacing_mm);
    EXPECT_EQ(volume.origin_mm, truth.origin_mm);
    EXPECT_LT((volume.direction - truth.direction).norm(), 1e-14);
    EXPECT_LT(largest_ramp_error(volume), kRounding_hu);
  }
}

TEST_F(MetaImage, AndNiftiOfOneObjectAgreeInTheWorld) {
  const Volume truth = ramp_volume(oblique_direction());
  write_metaimage(file_, truth);
  write_bytes(folder_.path() / "scan.nii", NiftiBytes(truth).bytes());
  const Volume meta = read_volume(file_), nifti = read_volume(folder_.path() / "scan.nii");
  EXPECT_TRUE(same_grid(meta, nifti));
  EXPECT_EQ(meta.voxels, nifti.voxels);
}

TEST_F(MetaImage, SameVolumeSameBytes) {
  write_metaimage(file_, ramp_volume());
  write_metaimage(folder_.path() / "again.mha", ramp_volume());
  EXPECT_EQ(read_bytes(file_), read_bytes(folder_.path() / "again.mha"));
}

TEST_F(MetaImage, ReadsRawTextAndDetachedData) {
  const Volume truth = ramp_volume();
  EXPECT_EQ(read(header("BinaryData = True\n") + raw_).voxels, truth.voxels);
  std::string text;
  for (const std::int16_t v : truth.voxels) text += std::to_string(v) + " ";
  EXPECT_EQ(read(header("BinaryData = False\n") + text).voxels, truth.voxels);
  write_bytes(folder_.path() / "scan.raw", "sixteen bytes..." + raw_);
  write_bytes(folder_.path() / "scan.mhd",
              header("HeaderSize = -1\n", "ElementDataFile = scan.raw\n"));
  EXPECT_EQ(read_volume(folder_.path() / "scan.mhd").voxels, truth.voxels);
}

TEST_F(MetaImage, VoxelsMayBeSpreadOverFilesByListOrPattern) {
  const std::size_t slice = raw_.size() / 3;
  for (std::size_t k = 0; k < 3; ++k) {
    write_bytes(folder_.path() / ("s" + std::to_string(k) + ".raw"), raw_.substr(k * slice, slice));
  }
  const auto truth = ramp_volume().voxels;
  EXPECT_EQ(read(header("", "ElementDataFile = LIST\ns0.raw\ns1.raw\ns2.raw\n")).voxels, truth);
  EXPECT_EQ(read(header("", "ElementDataFile = s%d.raw 0 2 1\n")).voxels, truth);
  write_bytes(folder_.path() / "s1.raw", "short");
  EXPECT_THAT(error(header("", "ElementDataFile = s%d.raw 0 2 1\n")), HasSubstr("truncated"));
}

TEST_F(MetaImage, OneOfSeveralTimePointsIsChosen) {
  const std::string four =
      "NDims = 4\nDimSize = 5 4 3 2\nElementSpacing = 0.8 1.25 3 1\nOffset = -40 25 110 0\n"
      "TransformMatrix = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\nElementType = MET_SHORT\n"
      "ElementDataFile = LOCAL\n";
  write_bytes(file_, four + std::string(raw_.size(), 'x') + raw_);
  const Volume second = read_volume(file_, {.time = 2});
  EXPECT_EQ(second.voxels, ramp_volume().voxels);
  EXPECT_TRUE(same_grid(second, ramp_volume()));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read_volume(file_); }),
              HasSubstr("holds 2 time points"));
}

TEST_F(MetaImage, TransformMatrixListsTheAxesOneAfterTheOther) {
  // Index axis 0 runs along +y, axis 1 along −x: the first three numbers are axis 0's direction.
  const Volume volume = read(header("TransformMatrix = 0 1 0 -1 0 0 0 0 1\n") + raw_);
  EXPECT_EQ(volume.direction.col(0), Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(volume.direction.col(1), Eigen::Vector3d(-1, 0, 0));
}

TEST_F(MetaImage, WithoutSpacingOneMillimetreIsAssumedWithAWarning) {
  const Volume volume = read(
      "NDims = 3\nDimSize = 5 4 3\nElementType = MET_SHORT\n"
      "ElementDataFile = LOCAL\n" +
      raw_);
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("1 mm was assumed")));
}

TEST_F(MetaImage, RefusesBadHeaders) {
  EXPECT_THAT(error("hello"), HasSubstr("no ElementDataFile"));
  EXPECT_THAT(error(header("NDims = 2\n") + raw_), HasSubstr("has 2 dimensions"));
  EXPECT_THAT(error(header("DimSize = 5 4\n") + raw_), HasSubstr("3-D volume is needed"));
  EXPECT_THAT(error(header("DimSize = 5 4 x\n") + raw_), HasSubstr("not a list of numbers"));
  EXPECT_THAT(error(header("DimSize = 5 4 0\n") + raw_), HasSubstr("a side of 0 voxels"));
  EXPECT_THAT(error(header("ElementType = MET_STRING\n") + raw_), HasSubstr("MET_STRING"));
  EXPECT_THAT(error(header("ElementNumberOfChannels = 3\n") + raw_), HasSubstr("channels"));
  EXPECT_THAT(error(header("ElementSpacing = 1 -1 0\n") + raw_), HasSubstr("spacing along axis 2"));
  EXPECT_THAT(error(header("TransformMatrix = 1 0 0 0 1 0 0 0\n") + raw_), HasSubstr("9 numbers"));
  EXPECT_THAT(error(header("TransformMatrix = 1 0 0 1 0 0 0 0 1\n") + raw_), HasSubstr("sheared"));
  EXPECT_THAT(error(header("DimSize = 60000 60000 9\n") + raw_), HasSubstr("limit"));
  EXPECT_THAT(error(header("DimSize = 2000 2000 9\n") + raw_), HasSubstr("truncated"));
  EXPECT_THAT(error(header("CompressedData = True\n") + raw_), HasSubstr("damaged"));
  EXPECT_THAT(error(header("", "ElementDataFile = LIST\n")), HasSubstr("names 0 files"));
  EXPECT_THAT(error(header("") + raw_ + "more"), HasSubstr("more data than its header"));
}

TEST_F(MetaImage, NamesAMissingDataFile) {
  write_bytes(file_, header("", "ElementDataFile = gone.raw\n"));
  EXPECT_THAT(message_of(ExitCode::no_input, [&] { read_volume(file_); }), HasSubstr("gone.raw"));
}

TEST(MetaImageRealData, LungOpens) {
  REQUIRE_SHARED_DATA("ct/lung/3DCT_lung_baseline_small.mha");
  const Volume lung = read_volume(shared_data("ct/lung/3DCT_lung_baseline_small.mha"));
  EXPECT_EQ(lung.size, (std::array<int, 3>{57, 78, 64}));
  EXPECT_EQ(lung.origin_mm, Eigen::Vector3d(-152.461, -148.986, -1432));
  EXPECT_LT(value_range(lung).min, -1000);
  const Volume mask = read_volume(shared_data("ct/lung/3DCT_lung_baseline_mask.mha"));
  EXPECT_EQ(count_labels(mask).size(), 1u);
}

}  // namespace
}  // namespace organbake
