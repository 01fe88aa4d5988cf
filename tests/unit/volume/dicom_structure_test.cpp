// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom/dicom_structure.h"

#include <gmock/gmock.h>

#include "organbake/core/temporary_folder.h"
#include "support/dicom_bytes.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

class DicomStructure : public ::testing::Test {
 protected:
  std::string flaw(const std::string& bytes) {
    write_bytes(file_, bytes);
    return flaw_of_dicom(file_);
  }
  // A segmentation whose pixels are compressed: sequences within sequences, then fragments.
  static std::string segmentation() {
    return SegBytes{"FRACTIONAL", 8, {{1, 0, std::vector<int>(35, 150)}}, true}.bytes();
  }

  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "a.dcm";
};

TEST_F(DicomStructure, SoundFilesHaveNoFlaw) {
  DicomBytes slice;
  slice.pixels.assign(12, 1000);
  EXPECT_EQ(flaw(slice.bytes()), "");
  EXPECT_EQ(flaw(enhanced_ct({slice, slice})), "");
  EXPECT_EQ(flaw(segmentation()), "");
  EXPECT_EQ(flaw(structure_set({{"liver", {{0, {{0, 0}, {9, 0}, {9, 9}}}}}})), "");
}

// A padding value's kind hangs on whether pixels are signed: nobody is to hear of that.
TEST_F(DicomStructure, NothingIsSaidOnTheTerminal) {
  DicomBytes slice;
  slice.pixels.assign(12, 1000);
  slice.padding = 900;
  testing::internal::CaptureStderr();
  EXPECT_EQ(flaw(slice.bytes()), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST_F(DicomStructure, RealFilesInEveryTransferSyntaxHaveNone) {
  REQUIRE_SHARED_DATA("dicom/transfer_syntaxes");
  for (const auto& entry :
       std::filesystem::directory_iterator(shared_data("dicom/transfer_syntaxes"))) {
    // Deflated ones are inflated before anybody looks.
    if (entry.path().filename().string().find("Deflated") != std::string::npos) continue;
    EXPECT_EQ(flaw_of_dicom(entry.path()), "") << entry.path();
  }
}

// Wherever a file ends too early, but between two elements that nothing holds together.
TEST_F(DicomStructure, WhatIsCutOffIsAFlaw) {
  const std::string whole = segmentation();
  const std::size_t sequences = whole.find(std::string("\x62\0\2\0SQ", 6));
  ASSERT_NE(sequences, whole.npos);
  int unseen = 0;
  for (std::size_t length = sequences; length < whole.size(); ++length)
    unseen += flaw(whole.substr(0, length)).empty();
  // Before each of the five elements from there on, and up to seven bytes into them.
  EXPECT_LE(unseen, 5 * 8);
}

TEST_F(DicomStructure, LyingLengthsAndEndlessNestingAreFlaws) {
  const std::string head = dicom_head("1.2.840.10008.5.1.4.1.1.66.4");
  EXPECT_THAT(flaw(head + dicom_element(0x62, 1, "CS", "BINARY").replace(6, 2, "\xF0\xFF")),
              HasSubstr("reaches beyond"));
  const std::string inner = dicom_element(0x62, 4, "US", "\1");
  std::string sequence = dicom_sequence(0x62, 2, {inner});
  EXPECT_EQ(flaw(head + sequence), "");
  EXPECT_THAT(flaw(head + dicom_sequence(0x62, 2, {inner}).replace(12, 4, "oops")),
              HasSubstr("something else than items"));
  for (int depth = 0; depth < 40; ++depth) sequence = dicom_sequence(0x62, 2, {sequence});
  EXPECT_THAT(flaw(head + sequence), HasSubstr("nested too deeply"));
}

}  // namespace
}  // namespace organbake
