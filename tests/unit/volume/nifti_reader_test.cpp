// SPDX-License-Identifier: GPL-3.0-or-later
#include "files/nifti_reader.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "organbake/core/temporary_folder.h"
#include "organbake/volume/read_volume.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Half a unit of rounding, and float32 affines: 1e-5 mm at 110 mm, 12 HU per mm.
constexpr double kRampTolerance_hu = 0.5 + 1e-3;

class NiftiReader : public ::testing::Test {
 protected:
  Volume read(const NiftiBytes& nifti) {
    write_bytes(file_, nifti.bytes());
    return read_volume(file_);
  }
  std::string error(const NiftiBytes& nifti) {
    write_bytes(file_, nifti.bytes());
    return message_of(ExitCode::bad_data, [&] { read_volume(file_); });
  }

  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "scan.nii";
};

std::vector<Eigen::Matrix3d> directions() {
  std::vector<Eigen::Matrix3d> all = {Eigen::Matrix3d::Identity(), oblique_direction()};
  for (int axis = 0; axis < 3; ++axis) {
    for (const Eigen::Matrix3d& proper :
         {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), oblique_direction()}) {
      all.push_back(proper);
      all.back().col(axis) *= -1;  // left-handed
    }
  }
  return all;
}

TEST_F(NiftiReader, SformPutsEveryVoxelInItsPlaceInTheWorld) {
  for (const Eigen::Matrix3d& direction : directions()) {
    const Volume truth = ramp_volume(direction);
    const Volume volume = read(NiftiBytes(truth));
    EXPECT_LT(largest_ramp_error(volume), kRampTolerance_hu);
    EXPECT_EQ(volume.voxels, truth.voxels);
    EXPECT_THAT(volume.warnings, IsEmpty());
  }
}

TEST_F(NiftiReader, QformPutsEveryVoxelInItsPlaceInTheWorld) {
  for (const Eigen::Matrix3d& direction : directions()) {
    const Volume truth = ramp_volume(direction);
    NiftiBytes nifti(truth);
    nifti.sform_code = 0;
    nifti.set_qform(truth);
    EXPECT_LT(largest_ramp_error(read(nifti)), kRampTolerance_hu);
  }
}

TEST_F(NiftiReader, SformWinsOverADifferentQformAndSaysSo) {
  const Volume truth = ramp_volume();
  NiftiBytes nifti(truth);
  Volume elsewhere = truth;
  elsewhere.origin_mm.x() += 10;
  nifti.set_qform(elsewhere);
  const Volume volume = read(nifti);
  EXPECT_LT(largest_ramp_error(volume), kRampTolerance_hu);
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("differ by up to 10.0 mm; the sform was used")));
}

TEST_F(NiftiReader, WithoutAPositionVoxelSizesAreUsedWithAWarning) {
  NiftiBytes nifti(ramp_volume());
  nifti.sform_code = 0;
  const Volume volume = read(nifti);
  EXPECT_NEAR(volume.spacing_mm.z(), 3, 1e-6);
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("no position or orientation")));
}

TEST_F(NiftiReader, ReadsGzipBigEndianMetresAndScaledTypes) {
  const Volume truth = ramp_volume(oblique_direction());
  write_bytes(folder_.path() / "scan.nii.gz", gzipped(NiftiBytes(truth).bytes()));
  EXPECT_EQ(read_volume(folder_.path() / "scan.nii.gz").voxels, truth.voxels);

  NiftiBytes big(truth);
  big.big_endian = true;
  for (std::size_t i = 0; i + 1 < big.voxels.size(); i += 2) {
    std::swap(big.voxels[i], big.voxels[i + 1]);
  }
  EXPECT_LT(largest_ramp_error(read(big)), kRampTolerance_hu);

  NiftiBytes metres(truth);
  metres.units = 1;
  for (float& value : metres.sform) value /= 1000;
  EXPECT_LT(largest_ramp_error(read(metres)), kRampTolerance_hu);

  NiftiBytes scaled(truth);
  scaled.slope = 2;
  scaled.intercept = -24;
  for (std::size_t v = 0; v < truth.voxels.size(); ++v) {
    ASSERT_EQ(read(scaled).voxels[v], 2 * truth.voxels[v] - 24);
  }
}

TEST_F(NiftiReader, SkipsExtensionsBeforeTheVoxels) {
  NiftiBytes nifti(ramp_volume());
  nifti.vox_offset = 352 + 64;
  nifti.voxels.insert(0, 64, 'x');
  EXPECT_LT(largest_ramp_error(read(nifti)), kRampTolerance_hu);
}

TEST_F(NiftiReader, AFourthDimensionOfOneIsFineAndOfTwoIsNot) {
  NiftiBytes nifti(ramp_volume());
  nifti.dim[0] = 4;
  EXPECT_LT(largest_ramp_error(read(nifti)), kRampTolerance_hu);
  nifti.dim[4] = 2;
  EXPECT_THAT(error(nifti), HasSubstr("holds 2 time points"));
}

TEST_F(NiftiReader, RefusesAnSformThatIsShearedBeyondSense) {
  NiftiBytes nifti(ramp_volume());
  nifti.sform[1] += 2.0f;
  EXPECT_THAT(error(nifti), HasSubstr("sheared by"));
}

TEST_F(NiftiReader, RefusesBadHeadersNamingFileAndValue) {
  const NiftiBytes good(ramp_volume());
  const auto spoiled = [&](auto spoil) {
    NiftiBytes nifti = good;
    spoil(nifti);
    const std::string message = error(nifti);
    EXPECT_THAT(message, HasSubstr("scan.nii"));
    return message;
  };
  EXPECT_THAT(spoiled([](auto& n) { n.dim = {3, 5, -4, 3, 1, 1, 1, 1}; }), HasSubstr("-4 voxels"));
  EXPECT_THAT(spoiled([](auto& n) { n.dim[0] = 2; }), HasSubstr("has 2 dimensions"));
  EXPECT_THAT(spoiled([](auto& n) { n.datatype = 32; }), HasSubstr("data type 32"));
  EXPECT_THAT(spoiled([](auto& n) { n.sform[0] = 0; }), HasSubstr("spacing along axis 0 is 0"));
  EXPECT_THAT(spoiled([](auto& n) { n.sform[3] = std::numeric_limits<float>::quiet_NaN(); }),
              HasSubstr("not finite"));
  EXPECT_THAT(spoiled([](auto& n) { n.vox_offset = -1; }), HasSubstr("start at byte -1"));
  EXPECT_THAT(spoiled([](auto& n) { n.magic = std::string("ni1\0", 4); }),
              HasSubstr("name it .hdr"));
  EXPECT_THAT(spoiled([](auto& n) { n.sizeof_hdr = 540; }), HasSubstr("too short"));
  EXPECT_THAT(spoiled([](auto& n) { n.dim = {3, 30000, 30000, 2, 1, 1, 1, 1}; }),
              HasSubstr("truncated: the header asks for"));
  EXPECT_THAT(spoiled([](auto& n) { n.voxels.pop_back(); }), HasSubstr("truncated"));
}

TEST_F(NiftiReader, RefusesDamagedAndTruncatedGzip) {
  const std::string whole = gzipped(NiftiBytes(ramp_volume()).bytes());
  // Every length: in the gzip header, the NIfTI header, the voxels and the checksum.
  for (std::size_t length = 2; length < whole.size(); ++length) {
    write_bytes(file_, whole.substr(0, length));
    message_of(ExitCode::bad_data, [&] { read_volume(file_); });
  }
  std::string flipped = whole;
  flipped[whole.size() - 6] ^= 1;  // in the checksum
  write_bytes(file_, flipped);
  message_of(ExitCode::bad_data, [&] { read_volume(file_); });
}

TEST(NiftiRealData, AbdomenOpensInItsPlace) {
  REQUIRE_SHARED_DATA("ct/abdomen/example_ct.nii.gz");
  const Volume ct = read_volume(shared_data("ct/abdomen/example_ct.nii.gz"));
  EXPECT_EQ(ct.size, (std::array<int, 3>{122, 101, 112}));
  EXPECT_EQ(value_range(ct).min, -1207);
  EXPECT_EQ(value_range(ct).max, 3382);
  // The header's RAS origin (−177.956, 11.319, 94.302), first index running to the right: in LPS.
  const Eigen::Vector3d origin(177.95632934570312, -11.319000244140625, 94.3017578125);
  EXPECT_LT((ct.origin_mm - origin).norm(), 1e-9);
  EXPECT_LT((ct.world_from_index({1, 1, 1}) - origin - Eigen::Vector3d(-3, -3, 3)).norm(), 1e-9);
}

}  // namespace
}  // namespace organbake
