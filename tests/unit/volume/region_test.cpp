// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/region.h"

#include <gmock/gmock.h>

#include "dicom_folder_fixture.h"
#include "organbake/core/files.h"
#include "organbake/volume/write_volume.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

const Eigen::Matrix3d kUprightBox = Eigen::Matrix3d::Identity();

TEST(Region, IsParsedFromTwoCorners) {
  const Region region = parse_region("10,-5,3, -2,7,9", "--roi");
  EXPECT_EQ(region.min_mm, Eigen::Vector3d(-2, -5, 3));
  EXPECT_EQ(region.max_mm, Eigen::Vector3d(10, 7, 9));
  for (const char* text : {"1,2,3", "a,b,c,d,e,f", "0,0,0,1,1,0", "1,2,3,4,5,6,7", ""}) {
    EXPECT_THAT(message_of(ExitCode::usage, [&] { parse_region(text, "--roi"); }),
                HasSubstr("--roi"))
        << text;
  }
}

TEST(Region, TakesOneVoxelMoreOnEverySide) {
  Volume grid;
  grid.size = {10, 10, 10};
  grid.spacing_mm = {1, 2, 3};
  const IndexBox box = voxels_of_region(grid, {{2.5, -50, 6}, {4.5, 4, 6.5}}, "grid");
  EXPECT_EQ(box.first, (std::array<int, 3>{1, 0, 1}));
  EXPECT_EQ(box.size, (std::array<int, 3>{6, 4, 4}));
  const Region outside = {{100, 0, 0}, {110, 5, 5}};
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { voxels_of_region(grid, outside, "grid"); }),
              HasSubstr("lies outside the volume"));
}

// A small box by the last voxel: fewer voxels on every axis, each in its own place.
Region corner_of(const Volume& volume) {
  const Eigen::Vector3d last(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1);
  const Eigen::Vector3d corner = volume.world_from_index(last.array() + 0.2);
  return {corner.array() - 0.05, corner.array() + 0.05};
}

void expect_part_of(const Volume& whole, const Volume& part, double tolerance_hu) {
  EXPECT_LT(part.voxels.size(), whole.voxels.size());
  EXPECT_LT(largest_ramp_error(part), tolerance_hu);
}

TEST(Region, CropsFilesOfEveryKind) {
  const TemporaryFolder folder;
  const Volume ramp = ramp_volume(oblique_direction());
  const auto packed = folder.path() / "ramp.mha";
  write_metaimage(packed, ramp);
  const Volume whole = read_volume(packed);
  expect_part_of(whole, read_volume(packed, {.region = corner_of(whole)}), kRounding_hu);
  const auto nifti = folder.path() / "ramp.nii.gz";
  const NiftiBytes bytes(ramp);
  write_bytes(nifti, gzipped(bytes.bytes()));
  expect_part_of(whole, read_volume(nifti, {.region = corner_of(whole)}), kRounding_hu);
}

TEST(Region, AGridAloneIsThatOfTheWholeFile) {
  const TemporaryFolder folder;
  const Volume ramp = ramp_volume(oblique_direction());
  const auto packed = folder.path() / "ramp.mha", nifti = folder.path() / "ramp.nii.gz";
  write_metaimage(packed, ramp);
  write_bytes(nifti, gzipped(NiftiBytes(ramp).bytes()));
  for (const auto& file : {packed, nifti}) {
    const Volume grid = read_volume(file, {.grid_only = true});
    EXPECT_EQ(grid.voxel_count(), 0u) << file;
    EXPECT_TRUE(same_grid(grid, read_volume(file))) << file;
  }
}

// Bytes that this process asked its files for; 0 where the kernel does not tell.
double bytes_read() { return number_behind("rchar:", "/proc/self/io").value_or(0); }

TEST(Region, LittleMoreIsReadOfAFileThanItHolds) {
  if (bytes_read() == 0) GTEST_SKIP() << "the kernel does not tell what is read";
  Volume volume;
  volume.size = {64, 64, 200};
  volume.spacing_mm = {1, 1, 1};
  volume.voxels.assign(64 * 64 * 200, 7);
  const TemporaryFolder folder;
  const auto file = folder.path() / "raw.mha";
  std::string bytes =
      "NDims = 3\nDimSize = 64 64 200\nElementSpacing = 1 1 1\nOffset = 0 0 0\n"
      "ElementType = MET_SHORT\nElementDataFile = LOCAL\n";
  bytes.append(reinterpret_cast<const char*>(volume.voxels.data()), 2 * volume.voxels.size());
  write_bytes(file, bytes);
  const double before = bytes_read();
  const Volume part = read_volume(file, {.region = Region{{0, 0, 100}, {63, 63, 117}}});
  EXPECT_EQ(part.size[2], 20);
  EXPECT_LT(bytes_read() - before, 0.1 * double(bytes.size()) + 20'000);  // and what opens a file
}

class DicomRegionTest : public DicomFolderTest {};

TEST_F(DicomRegionTest, ReadsOnlyTheSlicesItNeeds) {
  add_stack({0, 2, 4, 6, 8, 10, 12}, kUprightBox);
  DicomBytes torn = slice_at({5, -8, 32}, kUprightBox);  // the last one's pixels cannot be decoded
  torn.photometric = "RGB";
  add("slice1", torn);
  EXPECT_THAT(error(), HasSubstr("photometric"));
  const Volume part = read({.region = Region{{4, -9, 22}, {9, -6, 24}}});
  EXPECT_EQ(part.size[2], 4);  // 20, 22, 24, 26 mm
  EXPECT_LT(largest_ramp_error(part), kRounding_hu);
}

TEST_F(DicomRegionTest, OfAnUnevenTiltedStackIsThatPartOfTheWhole) {
  std::vector<double> along;
  for (int k = 0; k < 40; ++k) along.push_back(2 * k + (k > 20 ? 1 : 0));  // more than one piece
  add_stack(along, kUprightBox, 0.3 * kUprightBox.col(1));
  const Volume whole = read();
  const Volume part = read({.region = Region{{6, -2, 60}, {7, 6, 70}}});
  EXPECT_LT(part.voxels.size(), whole.voxels.size());
  for (int k = 0; k < part.size[2]; ++k) {
    for (int j = 0; j < part.size[1]; ++j) {
      for (int i = 0; i < part.size[0]; ++i) {
        const Eigen::Vector3d index =
            whole.index_from_world(part.world_from_index(Eigen::Vector3d(i, j, k)));
        const Eigen::Vector3i at = index.array().round().cast<int>();
        ASSERT_EQ(part.at(i, j, k), whole.at(at.x(), at.y(), at.z()));
      }
    }
  }
}

}  // namespace
}  // namespace organbake
