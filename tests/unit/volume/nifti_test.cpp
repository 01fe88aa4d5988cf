// SPDX-License-Identifier: GPL-3.0-or-later
// NIfTI as programs write it: places, types, pairs, time points, and affines that cannot be.
#include "files/volume_files.h"

#include "support/testing.h"
#include "volume_fixtures.h"

namespace organbake {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Nifti : public VolumeFileTest {
 protected:
  Nifti() : VolumeFileTest("scan.nii") {}
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

TEST_F(Nifti, SformPutsEveryVoxelInItsPlaceInTheWorld) {
  for (const Eigen::Matrix3d& direction : directions()) {
    const Volume truth = ramp_volume(direction);
    const Volume volume = read(NiftiBytes(truth).bytes());
    EXPECT_LT(largest_ramp_error(volume), kRounding_hu);
    EXPECT_EQ(volume.voxels, truth.voxels);
    EXPECT_THAT(volume.warnings, IsEmpty());
  }
}

TEST_F(Nifti, QformPutsEveryVoxelInItsPlaceInTheWorld) {
  for (const Eigen::Matrix3d& direction : directions()) {
    const Volume truth = ramp_volume(direction);
    NiftiBytes nifti(truth);
    nifti.sform_code = 0;
    nifti.set_qform(truth);
    EXPECT_LT(largest_ramp_error(read(nifti.bytes())), kRounding_hu);
  }
}

TEST_F(Nifti, SformWinsOverADifferentQformAndSaysSo) {
  const Volume truth = ramp_volume();
  NiftiBytes nifti(truth);
  Volume elsewhere = truth;
  elsewhere.origin_mm.x() += 10;
  nifti.set_qform(elsewhere);
  const Volume volume = read(nifti.bytes());
  EXPECT_LT(largest_ramp_error(volume), kRounding_hu);
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("differ by up to 10.0 mm; the sform was used")));
}

TEST_F(Nifti, WithoutAPositionVoxelSizesAreUsedWithAWarning) {
  NiftiBytes nifti(ramp_volume());
  nifti.sform_code = 0;
  const Volume volume = read(nifti.bytes());
  EXPECT_NEAR(volume.spacing_mm.z(), 3, 1e-6);
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("no position or orientation")));
}

TEST_F(Nifti, ReadsGzipBigEndianMetresAndScaledTypes) {
  const Volume truth = ramp_volume(oblique_direction());
  write_bytes(folder_.path() / "scan.nii.gz", gzipped(NiftiBytes(truth).bytes()));
  EXPECT_EQ(read_volume(folder_.path() / "scan.nii.gz").voxels, truth.voxels);

  NiftiBytes big(truth);
  big.big_endian = true;
  for (std::size_t i = 0; i + 1 < big.voxels.size(); i += 2) {
    std::swap(big.voxels[i], big.voxels[i + 1]);
  }
  EXPECT_LT(largest_ramp_error(read(big.bytes())), kRounding_hu);

  NiftiBytes metres(truth);
  metres.units = 1;
  for (float& value : metres.sform) value /= 1000;
  EXPECT_LT(largest_ramp_error(read(metres.bytes())), kRounding_hu);

  NiftiBytes scaled(truth);
  scaled.slope = 2;
  scaled.intercept = -24;
  for (std::size_t v = 0; v < truth.voxels.size(); ++v)
    ASSERT_EQ(read(scaled.bytes()).voxels[v], 2 * truth.voxels[v] - 24);
}

TEST_F(Nifti, AFourthDimensionOfOneIsFineAndOfTwoIsNot) {
  NiftiBytes nifti(ramp_volume());
  nifti.dim[0] = 4;
  EXPECT_LT(largest_ramp_error(read(nifti.bytes())), kRounding_hu);
  nifti.dim[4] = 2;
  EXPECT_THAT(error(nifti.bytes()), HasSubstr("holds 2 time points"));
}

TEST_F(Nifti, RefusesAnSformThatIsShearedBeyondSense) {
  NiftiBytes nifti(ramp_volume());
  nifti.sform[1] += 2.0f;
  EXPECT_THAT(error(nifti.bytes()), HasSubstr("sheared by"));
}

TEST_F(Nifti, RefusesBadHeadersNamingFileAndValue) {
  const NiftiBytes good(ramp_volume());
  const auto spoiled = [&](auto spoil) {
    NiftiBytes nifti = good;
    spoil(nifti);
    const std::string message = error(nifti.bytes());
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

TEST_F(Nifti, RefusesDamagedAndTruncatedGzip) {
  const std::string whole = gzipped(NiftiBytes(ramp_volume()).bytes());
  // Every length: in the gzip header, the NIfTI header, the voxels and the checksum.
  for (std::size_t length = 2; length < whole.size(); ++length) {
    error(whole.substr(0, length));
  }
  std::string flipped = whole;
  flipped[whole.size() - 6] ^= 1;  // in the checksum
  error(flipped);
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

// Two roundings: of the stored voxels, and of what lies between them.
constexpr double kResampled_hu = 1 + 1e-2;

TEST_F(Nifti, SecondVersionOfEitherByteOrder) {
  const Volume truth = ramp_volume(oblique_direction());
  NiftiBytes nifti(truth);
  for (const bool big_endian : {false, true}) {
    if (big_endian) nifti.swap_to_big_endian();
    const Volume volume = read(nifti.bytes_nifti2());
    EXPECT_EQ(volume.voxels, truth.voxels);
    EXPECT_LT(largest_ramp_error(volume), kRounding_hu);
    EXPECT_THAT(volume.warnings, IsEmpty());
  }
  write_bytes(folder_.path() / "scan.nii.gz", gzipped(NiftiBytes(truth).bytes_nifti2()));
  EXPECT_EQ(read_volume(folder_.path() / "scan.nii.gz").voxels, truth.voxels);
}

TEST_F(Nifti, APairIsReadByEitherName) {
  const Volume truth = ramp_volume(oblique_direction());
  NiftiBytes nifti(truth);
  nifti.magic = std::string("ni1\0", 4);
  nifti.vox_offset = 16;
  const std::string header = nifti.bytes().substr(0, 348);
  const std::string voxels = std::string(16, 'x') + nifti.voxels;
  write_bytes(folder_.path() / "a.b.hdr", header);
  write_bytes(folder_.path() / "a.b.img", voxels);
  write_bytes(folder_.path() / "packed.hdr.gz", gzipped(header));
  write_bytes(folder_.path() / "packed.img.gz", gzipped(voxels));
  for (const char* name : {"a.b.hdr", "a.b.img", "packed.hdr.gz", "packed.img.gz"}) {
    const Volume volume = read_volume(folder_.path() / name);
    EXPECT_EQ(volume.voxels, truth.voxels) << name;
    EXPECT_LT(largest_ramp_error(volume), kRounding_hu) << name;
  }
  std::filesystem::remove(folder_.path() / "a.b.img");
  EXPECT_THAT(message_of(ExitCode::no_input, [&] { read_volume(folder_.path() / "a.b.hdr"); }),
              HasSubstr(".img file of the same name"));
}

TEST_F(Nifti, AnalyzeIsRefusedWithTheReason) {
  NiftiBytes nifti(ramp_volume());
  nifti.magic = std::string(4, '\0');
  EXPECT_THAT(error(nifti.bytes()), HasSubstr("doesn't tell left from right"));
}

TEST_F(Nifti, OneOfSeveralTimePointsIsChosenAndNeverMixed) {
  const Volume truth = ramp_volume();
  NiftiBytes nifti(truth);
  nifti.dim = {4, 5, 4, 3, 3, 1, 1, 1};
  nifti.pixdim[4] = 0.5;
  nifti.units = 2 | 8;
  for (int step = 1; step < 3; ++step) {
    Volume later = truth;
    for (std::int16_t& voxel : later.voxels) voxel = static_cast<std::int16_t>(voxel + step);
    nifti.voxels += voxel_bytes(later);
  }
  for (int time = 1; time <= 3; ++time) {
    const Volume volume = read(nifti.bytes(), {.time = time});
    ASSERT_EQ(volume.voxels.size(), truth.voxels.size());
    EXPECT_EQ(volume.voxels.front(), truth.voxels.front() + time - 1);
    EXPECT_EQ(volume.voxels.back(), truth.voxels.back() + time - 1);
    EXPECT_EQ(volume.time_points, 3);
  }
  EXPECT_THAT(error(nifti.bytes()),
              HasSubstr("holds 3 time points, every 0.5 s; choose one with --time 1…3"));
  EXPECT_THAT(error(nifti.bytes(), {.time = 4}, ExitCode::usage), HasSubstr("no --time 4"));
  EXPECT_EQ(read(nifti.bytes(), {.any_time = true}).voxels, truth.voxels);
}

// The ramp on a grid whose second and third axes lean by an angle.
NiftiBytes sheared_ramp(double degrees, Eigen::Matrix3d& axes) {
  Volume truth = ramp_volume(oblique_direction());
  truth.size = {12, 11, 10};
  truth.voxels.clear();
  axes = truth.direction * truth.spacing_mm.asDiagonal();
  const double lean = std::tan(degrees * M_PI / 180);
  axes.col(1) += lean * truth.spacing_mm.y() * truth.direction.col(0);
  axes.col(2) += lean * truth.spacing_mm.z() * truth.direction.col(1);
  for_each_voxel(truth.size, [&](int i, int j, int k) {
    const double hu = ramp_hu(truth.origin_mm + axes * Eigen::Vector3d(i, j, k));
    truth.voxels.push_back(static_cast<std::int16_t>(std::lround(hu)));
  });
  NiftiBytes nifti(truth);
  const Eigen::Matrix3d ras = Eigen::Vector3d(-1, -1, 1).asDiagonal() * axes;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      nifti.sform[4 * row + column] = static_cast<float>(ras(row, column));
  return nifti;
}

TEST_F(Nifti, AShearOfRoundingTakesTheNearestGridAndSaysHowFarItIs) {
  Eigen::Matrix3d axes;
  const NiftiBytes nifti = sheared_ramp(0.2, axes);
  const Volume volume = read(nifti.bytes());
  EXPECT_EQ(volume.size, (std::array<int, 3>{12, 11, 10}));
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("sheared by 0.2")));
  const Eigen::Matrix3d gram = volume.direction.transpose() * volume.direction;
  EXPECT_LT((gram - Eigen::Matrix3d::Identity()).norm(), 1e-9);
  // 0.2° over half of a box of 10 × 14 × 30 mm: no voxel may be off by more than 0.06 mm.
  const Volume truth = ramp_volume(oblique_direction());
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(11, 10, 9),
                                    Eigen::Vector3d(11, 0, 9), Eigen::Vector3d(0, 10, 0)}) {
    const Eigen::Vector3d right = truth.origin_mm + axes * at;
    EXPECT_LT((volume.world_from_index(at) - right).norm(), 0.06);
  }
}

TEST_F(Nifti, AStrongerShearIsResampled) {
  for (const double degrees : {2.0, 20.0}) {
    Eigen::Matrix3d axes;
    const NiftiBytes nifti = sheared_ramp(degrees, axes);
    const Volume volume = read(nifti.bytes());
    EXPECT_THAT(volume.warnings, Contains(HasSubstr("resampled to a rectangular grid")));
    const Eigen::Matrix3d back = axes.inverse();
    const Volume truth = ramp_volume(oblique_direction());
    std::size_t inside = 0;
    for_each_voxel(volume.size, [&](int i, int j, int k) {
      const Eigen::Vector3d world = volume.world_from_index(Eigen::Vector3d(i, j, k));
      const Eigen::Vector3d index = back * (world - truth.origin_mm);
      if (index.minCoeff() < 0 || (index - Eigen::Vector3d(11, 10, 9)).maxCoeff() > 0) return;
      ++inside;
      EXPECT_NEAR(volume.at(i, j, k), ramp_hu(world), kResampled_hu);
    });
    EXPECT_GT(inside, 700u) << "of 11·10·9 cells' worth of voxels";
  }
}

TEST_F(Nifti, AShearedMaskKeepsItsLabels) {
  Eigen::Matrix3d axes;
  NiftiBytes nifti = sheared_ramp(20, axes);
  for (std::size_t i = 0; i < nifti.voxels.size(); i += 2) {
    nifti.voxels[i] = i % 3 == 0 ? 7 : 0;
    nifti.voxels[i + 1] = 0;
  }
  const Volume mask = read(nifti.bytes(), {.is_mask = true});
  EXPECT_EQ(value_range(mask).min, 0);
  EXPECT_EQ(count_labels(mask).size(), 1u);
  EXPECT_EQ(count_labels(mask)[0].label, 7);
}

TEST_F(Nifti, LabelNamesComeFromTheHeadersExtension) {
  NiftiBytes nifti(ramp_volume());
  nifti.set_named_labels();
  const Volume named = read(nifti.bytes(), {.label = "Gall_Bladder"});
  EXPECT_EQ(named.chosen_label, 11);
  EXPECT_EQ(named.label_names.size(), 2u);
  const Volume both = read(nifti.bytes(), {.label = "liver, 11"});
  EXPECT_EQ(both.chosen_label, 5);
  EXPECT_EQ(count_labels(both).size(), 1u);
  EXPECT_EQ(both.chosen_name, "liver and label 11");
  EXPECT_THAT(error(nifti.bytes(), {.label = "spleen"}),
              HasSubstr("no label \"spleen\"; it holds 5 liver, 11 gall bladder"));
  EXPECT_THAT(error(nifti.bytes(), {.label = "5,6"}), HasSubstr("no label 6; it holds 5 liver"));
}

TEST_F(Nifti, ACtIsNoMask) {
  const NiftiBytes nifti(ramp_volume());  // some of it below 0
  EXPECT_THAT(error(nifti.bytes(), {.is_mask = true}),
              HasSubstr("a mask's labels are 0 and above"));
  EXPECT_NO_THROW(read(nifti.bytes(), {}));
}

// The issue's: 1.6 × 1.6 × 3 mm, whose sform has steps of 1.
TEST_F(Nifti, AnAffineThatLostItsVoxelSizeIsRefusedUnlessAskedFor) {
  Volume truth = ramp_volume();
  truth.spacing_mm = {1.6, 1.6, 3};
  for (std::int16_t& value : truth.voxels) value = std::abs(value);  // as a mask's
  NiftiBytes nifti(truth);
  for (float& step : nifti.sform) step = std::fabs(step) > 0 ? std::copysign(1.0f, step) : 0;
  for (const bool is_mask : {false, true}) {
    EXPECT_THAT(
        error(nifti.bytes(), {.is_mask = is_mask}),
        HasSubstr("voxels of 1.00 × 1.00 × 1.00 where the header's voxel sizes (pixdim) are "
                  "1.60 × 1.60 × 3.00"));
    const Volume scaled =
        read(nifti.bytes(), {.is_mask = is_mask, .unit_affine = UnitAffine::scale});
    EXPECT_LT((scaled.spacing_mm - truth.spacing_mm).norm(), 1e-6) << "float32";
    const Volume kept = read(nifti.bytes(), {.is_mask = is_mask, .unit_affine = UnitAffine::keep});
    EXPECT_EQ(kept.spacing_mm, Eigen::Vector3d(1, 1, 1));
    EXPECT_THAT(kept.warnings, Contains(HasSubstr("differ by up to 67 %; the sform was taken")));
  }
}

TEST_F(Nifti, AnAffineOfOtherStepsThanItsHeaderIsTakenAndSaid) {
  NiftiBytes nifti(ramp_volume());
  nifti.pixdim[1] *= 1.25f;
  const Volume volume = read(nifti.bytes());
  EXPECT_LT(largest_ramp_error(volume), kRounding_hu);
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("differ by up to 20 %; the sform was taken")));
  nifti.pixdim[1] = 0;
  EXPECT_THAT(read(nifti.bytes()).warnings, IsEmpty()) << "not told";
}

}  // namespace
}  // namespace organbake
