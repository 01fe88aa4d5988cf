// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/read_volume.h"

#include <gmock/gmock.h>

#include "organbake/core/temporary_folder.h"
#include "organbake/volume/write_volume.h"
#include "support/dicom_bytes.h"
#include "support/ramp_volume.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

class ReadVolume : public ::testing::Test {
 protected:
  std::string error(ExitCode code, const std::string& name) {
    return message_of(code, [&] { read_volume(folder_.path() / name); });
  }
  TemporaryFolder folder_;
};

TEST_F(ReadVolume, TellsTheKindByContentNotByName) {
  const Volume truth = ramp_volume();
  write_bytes(folder_.path() / "nifti", NiftiBytes(truth).bytes());
  write_bytes(folder_.path() / "nifti.mha", gzipped(NiftiBytes(truth).bytes()));
  EXPECT_EQ(read_volume(folder_.path() / "nifti").voxels, truth.voxels);
  EXPECT_EQ(read_volume(folder_.path() / "nifti.mha").voxels, truth.voxels);
}

TEST_F(ReadVolume, WhatIsNotThereIsNoInput) {
  EXPECT_THAT(error(ExitCode::no_input, "gone.nii.gz"), HasSubstr("does not exist"));
  std::filesystem::create_directory(folder_.path() / "empty");
  EXPECT_THAT(error(ExitCode::no_input, "empty"), HasSubstr("holds no files"));
  std::filesystem::create_directory(folder_.path() / "texts");
  write_bytes(folder_.path() / "texts/a.txt", "hello");
  write_bytes(folder_.path() / "texts/b.csv", std::string(1000, 'b'));
  EXPECT_THAT(error(ExitCode::no_input, "texts"), HasSubstr("no DICOM image among its 2 files"));
  std::filesystem::create_directories(folder_.path() / "study/series");
  EXPECT_THAT(error(ExitCode::no_input, "study"), HasSubstr("give the subfolder"));
}

TEST_F(ReadVolume, WhatIsNoVolumeIsBadData) {
  write_bytes(folder_.path() / "empty.nii", "");
  EXPECT_THAT(error(ExitCode::bad_data, "empty.nii"), HasSubstr("is empty"));
  write_bytes(folder_.path() / "note.txt", "just some words");
  EXPECT_THAT(error(ExitCode::bad_data, "note.txt"), HasSubstr("is not a volume"));
  write_bytes(folder_.path() / "scan.vtk", "# vtk DataFile Version 3.0\nscan\nASCII\n");
  EXPECT_THAT(error(ExitCode::bad_data, "scan.vtk"), HasSubstr("save it as .vti"));
  write_bytes(folder_.path() / "a.gz", gzipped("just some words"));
  EXPECT_THAT(error(ExitCode::bad_data, "a.gz"), HasSubstr("too short for a NIfTI header"));
  DicomBytes slice;
  slice.pixels.assign(12, 0);
  write_bytes(folder_.path() / "slice", slice.bytes());
  EXPECT_THAT(error(ExitCode::bad_data, "slice"), HasSubstr("the only CT slice"));
}

TEST_F(ReadVolume, EveryTruncationIsAnErrorAndNotACrash) {
  write_metaimage(folder_.path() / "whole.mha", ramp_volume());
  const std::string meta = read_bytes(folder_.path() / "whole.mha");
  const std::string nifti = NiftiBytes(ramp_volume()).bytes();
  for (const auto& [name, whole] : {std::pair{"cut.mha", meta}, std::pair{"cut.nii", nifti}}) {
    for (std::size_t length = 0; length < whole.size(); length += 3) {
      write_bytes(folder_.path() / name, whole.substr(0, length));
      // "ElementDataFile = LOC" names another file, which is missing: 66 instead of 65.
      EXPECT_THROW(read_volume(folder_.path() / name), Error) << name << " cut at " << length;
    }
  }
}

TEST_F(ReadVolume, CancelledBeforeItBegins) {
  const std::atomic<bool> cancel = true;
  const RunContext context({}, {}, &cancel);
  EXPECT_THROW(read_volume(folder_.path(), context), CancelledError);
}

}  // namespace
}  // namespace organbake
