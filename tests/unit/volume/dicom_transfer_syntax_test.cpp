// SPDX-License-Identifier: GPL-3.0-or-later
// One CT slice in many transfer syntaxes, beside the same slice uncompressed.
#include <gmock/gmock.h>

#include <cstdlib>
#include <span>

#include "dicom/dicom_pixels.h"
#include "organbake/volume/dicom_slice.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

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
  for (std::size_t i = 0; i < a.voxels.size(); ++i) {
    largest = std::max(largest, std::abs(a.voxels[i] - b.voxels[i]));
  }
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
