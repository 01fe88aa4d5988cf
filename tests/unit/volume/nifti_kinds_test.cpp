// SPDX-License-Identifier: GPL-3.0-or-later
#include <gmock/gmock.h>

#include <Eigen/Geometry>

#include "organbake/core/temporary_folder.h"
#include "organbake/volume/read_volume.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Half a unit of rounding, and float32 affines: 1e-5 mm at 110 mm, 12 HU per mm.
constexpr double kNiftiRounding_hu = 0.5 + 1e-3;
// Two roundings: of the stored voxels, and of what lies between them.
constexpr double kResampled_hu = 1 + 1e-2;

class NiftiKinds : public ::testing::Test {
 protected:
  Volume read(const std::string& bytes, const VolumeReadOptions& options = {}) {
    write_bytes(file_, bytes);
    return read_volume(file_, options);
  }

  TemporaryFolder folder_;
  fs::path file_ = folder_.path() / "scan.nii";
};

TEST_F(NiftiKinds, Nifti2OfEitherByteOrder) {
  const Volume truth = ramp_volume(oblique_direction());
  NiftiBytes nifti(truth);
  for (const bool big_endian : {false, true}) {
    if (big_endian) nifti.swap_to_big_endian();
    const Volume volume = read(nifti.bytes_nifti2());
    EXPECT_EQ(volume.voxels, truth.voxels);
    EXPECT_LT(largest_ramp_error(volume), kNiftiRounding_hu);
    EXPECT_THAT(volume.warnings, IsEmpty());
  }
  write_bytes(folder_.path() / "scan.nii.gz", gzipped(NiftiBytes(truth).bytes_nifti2()));
  EXPECT_EQ(read_volume(folder_.path() / "scan.nii.gz").voxels, truth.voxels);
}

TEST_F(NiftiKinds, APairIsReadByEitherName) {
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
    EXPECT_LT(largest_ramp_error(volume), kNiftiRounding_hu) << name;
  }
  fs::remove(folder_.path() / "a.b.img");
  EXPECT_THAT(message_of(ExitCode::no_input, [&] { read_volume(folder_.path() / "a.b.hdr"); }),
              HasSubstr(".img file of the same name"));
}

TEST_F(NiftiKinds, AnalyzeIsRefusedWithTheReason) {
  NiftiBytes nifti(ramp_volume());
  nifti.magic = std::string(4, '\0');
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read(nifti.bytes()); }),
              HasSubstr("doesn't tell left from right"));
}

TEST_F(NiftiKinds, OneOfSeveralTimePointsIsChosenAndNeverMixed) {
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
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read(nifti.bytes()); }),
              HasSubstr("holds 3 time points, every 0.5 s; choose one with --time 1…3"));
  EXPECT_THAT(message_of(ExitCode::usage, [&] { read(nifti.bytes(), {.time = 4}); }),
              HasSubstr("no --time 4"));
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
  for (int k = 0; k < 10; ++k) {
    for (int j = 0; j < 11; ++j) {
      for (int i = 0; i < 12; ++i) {
        const double hu = ramp_hu(truth.origin_mm + axes * Eigen::Vector3d(i, j, k));
        truth.voxels.push_back(static_cast<std::int16_t>(std::lround(hu)));
      }
    }
  }
  NiftiBytes nifti(truth);
  const Eigen::Matrix3d ras = Eigen::Vector3d(-1, -1, 1).asDiagonal() * axes;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      nifti.sform[4 * row + column] = static_cast<float>(ras(row, column));
    }
  }
  return nifti;
}

TEST_F(NiftiKinds, AShearOfRoundingTakesTheNearestGridAndSaysHowFarItIs) {
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

TEST_F(NiftiKinds, AStrongerShearIsResampled) {
  for (const double degrees : {2.0, 20.0}) {
    Eigen::Matrix3d axes;
    const NiftiBytes nifti = sheared_ramp(degrees, axes);
    const Volume volume = read(nifti.bytes());
    EXPECT_THAT(volume.warnings, Contains(HasSubstr("resampled to a rectangular grid")));
    const Eigen::Matrix3d back = axes.inverse();
    const Volume truth = ramp_volume(oblique_direction());
    std::size_t inside = 0;
    for (int k = 0; k < volume.size[2]; ++k) {
      for (int j = 0; j < volume.size[1]; ++j) {
        for (int i = 0; i < volume.size[0]; ++i) {
          const Eigen::Vector3d world = volume.world_from_index(Eigen::Vector3d(i, j, k));
          const Eigen::Vector3d index = back * (world - truth.origin_mm);
          if (index.minCoeff() < 0 || (index - Eigen::Vector3d(11, 10, 9)).maxCoeff() > 0) {
            continue;
          }
          ++inside;
          ASSERT_NEAR(volume.at(i, j, k), ramp_hu(world), kResampled_hu);
        }
      }
    }
    EXPECT_GT(inside, 700u) << "of 11·10·9 cells' worth of voxels";
  }
}

TEST_F(NiftiKinds, AShearedMaskKeepsItsLabels) {
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

TEST_F(NiftiKinds, LabelNamesComeFromTheHeadersExtension) {
  NiftiBytes nifti(ramp_volume());
  nifti.set_named_labels();
  const Volume named = read(nifti.bytes(), {.label = "Gall_Bladder"});
  EXPECT_EQ(named.chosen_label, 11);
  EXPECT_EQ(named.label_names.size(), 2u);
  const Volume both = read(nifti.bytes(), {.label = "liver, 11"});
  EXPECT_EQ(both.chosen_label, 5);
  EXPECT_EQ(count_labels(both).size(), 1u);
  EXPECT_EQ(both.chosen_name, "liver and label 11");
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read(nifti.bytes(), {.label = "spleen"}); }),
              HasSubstr("no label \"spleen\"; it holds 5 liver, 11 gall bladder"));
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { read(nifti.bytes(), {.label = "5,6"}); }),
              HasSubstr("no label 6; it holds 5 liver"));
}

// The issue's: 1.6 × 1.6 × 3 mm, whose sform has steps of 1.
TEST_F(NiftiKinds, AnAffineThatLostItsVoxelSizeIsRefusedUnlessAskedFor) {
  Volume truth = ramp_volume();
  truth.spacing_mm = {1.6, 1.6, 3};
  NiftiBytes nifti(truth);
  for (float& step : nifti.sform) step = std::fabs(step) > 0 ? std::copysign(1.0f, step) : 0;
  for (const bool is_mask : {false, true}) {
    EXPECT_THAT(
        message_of(ExitCode::bad_data, [&] { read(nifti.bytes(), {.is_mask = is_mask}); }),
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

TEST_F(NiftiKinds, AnAffineOfOtherStepsThanItsHeaderIsTakenAndSaid) {
  NiftiBytes nifti(ramp_volume());
  nifti.pixdim[1] *= 1.25f;
  const Volume volume = read(nifti.bytes());
  EXPECT_LT(largest_ramp_error(volume), kNiftiRounding_hu);
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("differ by up to 20 %; the sform was taken")));
  nifti.pixdim[1] = 0;
  EXPECT_THAT(read(nifti.bytes()).warnings, IsEmpty()) << "not told";
}

}  // namespace
}  // namespace organbake
