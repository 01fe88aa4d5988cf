// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/reference_frames.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/temporary_files.h"
#include "organbake/image/png.h"

namespace organbake {
namespace {

Rgb8Image grey_picture(std::uint8_t level) {
  Rgb8Image picture(8, 6);
  std::fill(picture.pixels.begin(), picture.pixels.end(), level);
  return picture;
}

class ReferenceFramesTest : public testing::Test {
 protected:
  ReferenceFramesTest() {
    for (int i = 0; i < 3; ++i) write_png(folder_.path() / frame_file_name(i), grey_picture(100));
  }
  TemporaryFolder folder_;
};

TEST_F(ReferenceFramesTest, EqualFramesPassAnyThreshold) {
  ReferenceFrames reference(folder_.path(), 3);
  for (int i = 0; i < 3; ++i) reference.compare(i, grey_picture(100));
  EXPECT_TRUE(std::isinf(reference.least_psnr_db()));
  EXPECT_NO_THROW(reference.check(1000));
}

TEST_F(ReferenceFramesTest, TheWorstFrameDecides) {
  ReferenceFrames reference(folder_.path(), 3);
  reference.compare(0, grey_picture(101));
  reference.compare(1, grey_picture(110));
  reference.compare(2, grey_picture(100));
  EXPECT_NEAR(reference.least_psnr_db(), 20 * std::log10(255.0 / 10), 1e-9);
  EXPECT_EQ(reference.worst_frame(), 1);
  EXPECT_NO_THROW(reference.check(28));
  try {
    reference.check(29);
    FAIL() << "10 levels off are 28.13 dB";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ExitCode::quality_gate);
    EXPECT_NE(std::string(error.what()).find("frame_0001.png"), std::string::npos);
  }
}

TEST_F(ReferenceFramesTest, RefusesWhatCannotBeCompared) {
  EXPECT_THROW(ReferenceFrames(folder_.path() / "none", 3), NoInputError);
  EXPECT_THROW(ReferenceFrames(folder_.path(), 4), BadDataError);
  EXPECT_THROW(ReferenceFrames(folder_.path(), 2), BadDataError);
  ReferenceFrames reference(folder_.path(), 3);
  EXPECT_THROW(reference.compare(0, Rgb8Image(6, 8)), BadDataError);
}

}  // namespace
}  // namespace organbake
