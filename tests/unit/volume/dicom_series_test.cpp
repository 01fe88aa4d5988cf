// SPDX-License-Identifier: GPL-3.0-or-later
// Which series of a folder is read, and real files in every transfer syntax.
#include "dicom/dicom.h"

#include "support/files.h"
#include "support/testing.h"
#include "volume_fixtures.h"

namespace organbake {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const Eigen::Matrix3d kUpright = Eigen::Matrix3d::Identity();

class DicomSeriesTest : public DicomFolderTest {
 protected:
  DicomBytes slice(double z) const { return slice_at({5, -8, z}, kUpright); }
  // Slices of another series, 2 mm apart.
  void add_series(const std::string& uid, const std::string& number, int count,
                  const std::string& modality = "CT") {
    for (int k = 0; k < count; ++k) {
      DicomBytes one = slice(20 + 2 * k);
      one.series_uid = uid;
      one.series_number = number;
      one.modality = modality;
      add(uid + "-" + std::to_string(k), one);
    }
  }
};

TEST_F(DicomSeriesTest, AreTakenByUidOrNumber) {
  add_series("1.2.30", "3", 4);
  add_series("1.2.50", "5", 2);
  EXPECT_EQ(read().size[2], 4);
  EXPECT_EQ(read({.series = "5"}).size[2], 2);
  EXPECT_EQ(read({.series = "1.2.50"}).size[2], 2);
  EXPECT_THAT(read({.series = "5"}).warnings, IsEmpty());
  EXPECT_THAT(error({.series = "9"}), AllOf(HasSubstr("holds no series \"9\""),
                                            HasSubstr("UID 1.2.30"), HasSubstr("UID 1.2.50")));
  add_series("1.2.51", "5", 3);
  EXPECT_THAT(error({.series = "5"}), HasSubstr("several series have the number 5"));
  EXPECT_EQ(read({.series = "1.2.51"}).size[2], 3);
}

TEST_F(DicomSeriesTest, TheOnlyCtVolumeIsTakenWhateverElseIsLarger) {
  add_series("1.2.1", "1", 6, "MR");
  add_series("1.2.2", "2", 3);
  add_series("1.2.4", "4", 1);
  const Volume volume = read();
  EXPECT_EQ(volume.size[2], 3);
  EXPECT_THAT(volume.warnings,
              Contains(AllOf(HasSubstr("of 3 series, series 2 was taken, the only CT volume (3)"),
                             HasSubstr("modality \"MR\""), HasSubstr("needs at least two"))));
  EXPECT_THAT(error({.series = "1"}), HasSubstr("series 1 gives no CT volume"));
}

TEST_F(DicomSeriesTest, NumbersAreOrderedAsNumbers) {
  add_series("1.2.10", "10", 2);
  add_series("1.2.9", "9", 2);
  const std::vector<DicomSeries> all = list_series(scan_dicom_folder(folder_.path()));
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].number, "9");
  EXPECT_TRUE(all[1].fit());
}

TEST_F(DicomSeriesTest, StrayImagesArePassedOverByName) {
  add_stack({0, 2, 4}, kUpright);
  DicomBytes scout = slice(22), turned = slice(21);
  scout.image_type = "ORIGINAL\\PRIMARY\\LOCALIZER";
  add("scout", scout);
  turned.orientation = "0\\1\\0\\0\\0\\-1";
  add("turned", turned);
  const Volume volume = read();
  EXPECT_EQ(volume.size[2], 3);
  EXPECT_LT(largest_ramp_error(volume), kRounding_hu);
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("a localizer (scout)")));
  EXPECT_THAT(volume.warnings,
              Contains(HasSubstr("another size, direction or pixel spacing (turn")));
}

TEST_F(DicomSeriesTest, CopiesArePassedOverByName) {
  add_stack({0, 2, 4}, kUpright);
  add("slice2-copy", slice(22));
  const Volume volume = read();
  EXPECT_EQ(volume.size[2], 3);
  EXPECT_LT(largest_ramp_error(volume), kRounding_hu);
  EXPECT_THAT(volume.warnings,
              Contains(HasSubstr("1 copies of slices were passed over (slice2-c")));
  EXPECT_THAT(error({.strict = true}), HasSubstr("--strict refuses to mend it: 1 copies"));
}

TEST_F(DicomSeriesTest, OfTwoAcquisitionsTheLargerIsTaken) {
  for (int acquisition = 1; acquisition <= 2; ++acquisition) {
    for (int k = 0; k < 2 + acquisition; ++k) {
      DicomBytes one = slice(20 + 2 * k);
      one.acquisition = std::to_string(acquisition);
      if (acquisition == 1) one.pixels.assign(one.pixels.size(), 3000);
      add(one.acquisition + "-" + std::to_string(k), one);
    }
  }
  const Volume volume = read();
  EXPECT_EQ(volume.size[2], 4);
  EXPECT_LT(largest_ramp_error(volume), kRounding_hu);
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("acquisition 2 was taken")));
}

TEST_F(DicomSeriesTest, DifferentSlicesInOnePlaceAreRefused) {
  add_stack({0, 2, 4}, kUpright);
  DicomBytes other = slice(22);
  other.pixels.front() += 1;
  add("other", other);
  EXPECT_THAT(error(), AllOf(HasSubstr("lies in the same place as"), HasSubstr("differs")));
}

TEST_F(DicomSeriesTest, AllSlicesInOnePlaceAreRefused) {
  for (int k = 0; k < 3; ++k) add("slice" + std::to_string(k), slice(20));
  EXPECT_THAT(error(), HasSubstr("all 3 slices lie in one place"));
}

TEST_F(DicomSeriesTest, ASliceBesideTheOthersIsRefused) {
  add_stack({0, 2, 4, 6}, kUpright);
  DicomBytes strayed = slice(24);
  strayed.set_position({500005, -8, 24});
  add("slice2", strayed);
  EXPECT_THAT(error(), AllOf(HasSubstr("slice2"), HasSubstr("500000.0 mm beside")));
}

TEST_F(DicomSeriesTest, AMissingSliceIsNamed) {
  add_stack({0, 2, 4, 8, 10, 12}, kUpright);
  const Volume volume = read();
  EXPECT_EQ(volume.size[2], 7);
  EXPECT_LT(largest_ramp_error(volume), kTwiceRounded_hu);
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("are missing: 1 between slice4 and slice3")));
  EXPECT_THAT(error({.strict = true}),
              HasSubstr("--strict refuses to mend it: slices are missing"));
}

TEST_F(DicomSeriesTest, StrictRefusesUnevenAndDamagedSlices) {
  add_stack({0, 2, 4, 7, 9}, kUpright);
  EXPECT_THAT(error({.strict = true}), HasSubstr("unevenly spaced"));
  add_stack({0, 2, 4, 6, 8}, kUpright);
  EXPECT_EQ(read({.strict = true}).size[2], 5);
  write_bytes(folder_.path() / "torn", slice(40).bytes().substr(0, 300));
  EXPECT_EQ(read().size[2], 5);
  EXPECT_THAT(error({.strict = true}), HasSubstr("damaged"));
}

TEST_F(DicomSeriesTest, PaddingBecomesAir) {
  for (int k = 0; k < 3; ++k) {
    DicomBytes one = slice(20 + 2 * k);
    one.padding = 0;  // −1024 HU
    one.pixels[5] = 0;
    add("slice" + std::to_string(k), one);
  }
  const Volume volume = read();
  EXPECT_EQ(volume.voxels[5], kAir_hu);
  EXPECT_NEAR(volume.voxels[6], ramp_hu(volume.world_from_index({2, 1, 0})), kRounding_hu);
}

TEST_F(DicomSeriesTest, PaddingThatTissueHasTooIsLeftAlone) {
  for (int k = 0; k < 3; ++k) {
    DicomBytes one = slice(20 + 2 * k);
    one.padding = 1024;  // 0 HU, water
    one.pixels[5] = 1024;
    add("slice" + std::to_string(k), one);
  }
  const Volume volume = read();
  EXPECT_EQ(volume.voxels[5], 0);
  EXPECT_THAT(volume.warnings, Contains(HasSubstr("padding value would be 0 HU")));
}

// One CT slice in many transfer syntaxes, beside the same slice uncompressed.

Volume decoded(const std::string& name) {
  const ScannedFile file = scan_dicom_file(shared_data("dicom/transfer_syntaxes/" + name));
  if (!file.slice) throw BadDataError(file.file, file.reason);
  Volume volume;
  volume.size = {file.slice->columns, file.slice->rows, 1};
  decode_slices(std::span(&*file.slice, 1), IndexBox::whole(volume), volume, {});
  return volume;
}

int largest_difference(const Volume& a, const Volume& b) {
  int largest = 0;
  for (std::size_t i = 0; i < a.voxels.size(); ++i)
    largest = std::max(largest, std::abs(a.voxels[i] - b.voxels[i]));
  return largest;
}

struct Coded {
  const char* name;
  int allowed_hu;  // by the data's README
};

class TransferSyntax : public ::testing::TestWithParam<Coded> {};

TEST_P(TransferSyntax, GivesTheReferencesPixels) {
  REQUIRE_SHARED_DATA("dicom/transfer_syntaxes");
  const Volume reference = decoded("CTImage.dcm");
  ASSERT_EQ(reference.voxels.size(), 512u * 512u);
  EXPECT_GT(value_range(reference).max - value_range(reference).min, 1000);
  const Volume other = decoded(std::string("CTImage.dcm_") + GetParam().name + ".dcm");
  ASSERT_EQ(other.voxels.size(), reference.voxels.size());
  EXPECT_LE(largest_difference(reference, other), GetParam().allowed_hu);
}

INSTANTIATE_TEST_SUITE_P(
    OfOneSlice, TransferSyntax,
    ::testing::Values(Coded{"LittleEndianImplicitTransferSyntax_1.2.840.10008.1.2", 0},
                      Coded{"LittleEndianExplicitTransferSyntax_1.2.840.10008.1.2.1", 0},
                      Coded{"DeflatedExplicitVRLittleEndianTransferSyntax_1.2.840.10008.1.2.1.99",
                            0},
                      Coded{"BigEndianExplicitTransferSyntax_1.2.840.10008.1.2.2", 0},
                      Coded{"RLELosslessTransferSyntax_1.2.840.10008.1.2.5", 0},
                      Coded{"JPEGProcess14TransferSyntax_1.2.840.10008.1.2.4.57", 0},
                      Coded{"JPEGProcess14SV1TransferSyntax_1.2.840.10008.1.2.4.70", 0},
                      Coded{"JPEGLSLosslessTransferSyntax_1.2.840.10008.1.2.4.80", 0},
                      Coded{"JPEGLSLossyTransferSyntax_1.2.840.10008.1.2.4.81", 1},
                      Coded{"JPEG2000LosslessOnlyTransferSyntax_1.2.840.10008.1.2.4.90", 0},
                      Coded{"JPEG2000TransferSyntax_1.2.840.10008.1.2.4.91", 5}));

TEST(TransferSyntaxes, ThatDecodeToGarbageAreRefused) {
  REQUIRE_SHARED_DATA("dicom/transfer_syntaxes");
  for (const char* name : {"JPEGProcess1TransferSyntax_1.2.840.10008.1.2.4.50",
                           "JPEGProcess2_4TransferSyntax_1.2.840.10008.1.2.4.51",
                           "JPEGProcess6_8TransferSyntax_1.2.840.10008.1.2.4.53",
                           "JPEGProcess10_12TransferSyntax_1.2.840.10008.1.2.4.55"}) {
    const std::string file = std::string("CTImage.dcm_") + name + ".dcm";
    const std::string message = message_of(ExitCode::bad_data, [&] { decoded(file); });
    EXPECT_THAT(message, HasSubstr("lossy JPEG")) << name;
    EXPECT_THAT(message, HasSubstr(file));
  }
}

}  // namespace
}  // namespace organbake
