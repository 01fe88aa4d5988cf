// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/video_reader.h"

#include <gmock/gmock.h>

#include <fstream>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_folder.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

fs::path real_clip() {
  return fs::path(ORGANBAKE_SHARED_DATA) / "video/laparoscopy_720p_25fps.mp4";
}

TEST(VideoReader, RefusesWhatIsNoVideo) {
  const TemporaryFolder folder;
  EXPECT_THROW(VideoReader(folder.path() / "missing.mp4"), NoInputError);
  write_file_atomically(folder.path() / "text.mp4", std::string_view("just words"));
  EXPECT_THROW(VideoReader(folder.path() / "text.mp4"), BadDataError);
}

TEST(VideoReader, RealClipFrontToBack) {
  if (!fs::exists(real_clip())) GTEST_SKIP() << "real data is missing: " << real_clip();
  VideoReader reader(real_clip());
  StoredPicture frame;
  double red = 0, blue = 0;
  while (reader.next(frame)) {
    ASSERT_EQ(frame.color.width, 1280);
    ASSERT_EQ(frame.color.height, 720);
    const std::uint8_t* middle = frame.color.at(640, 360);
    red += middle[0];
    blue += middle[2];
  }
  EXPECT_EQ(reader.frames_read(), 250u);
  EXPECT_GT(red, 1.2 * blue) << "tissue";
}

TEST(VideoReader, ACutFileGivesItsFramesAndThenSaysWhere) {
  if (!fs::exists(real_clip())) GTEST_SKIP() << "real data is missing: " << real_clip();
  const TemporaryFolder folder;
  const std::vector<std::byte> whole = read_file(real_clip());
  const fs::path cut = folder.path() / "cut.mp4";
  write_file_atomically(cut, std::span(whole).first(whole.size() / 4));
  try {
    VideoReader reader(cut);
    StoredPicture frame;
    while (reader.next(frame)) {
    }
    FAIL() << "read " << reader.frames_read() << " frames of a cut file as if it were whole";
  } catch (const BadDataError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("cut.mp4"));
  }
}

}  // namespace
}  // namespace organbake
