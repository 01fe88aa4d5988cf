// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/video_reader.h"

#include <gmock/gmock.h>

#include <fstream>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_folder.h"
#include "support/places.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

fs::path real_clip() { return shared_data("video/laparoscopy_720p_25fps.mp4"); }

TEST(VideoReader, RefusesWhatIsNoVideo) {
  const TemporaryFolder folder;
  EXPECT_THROW(VideoReader(folder.path() / "missing.mp4"), NoInputError);
  write_file_atomically(folder.path() / "text.mp4", std::string_view("just words"));
  EXPECT_THROW(VideoReader(folder.path() / "text.mp4"), BadDataError);
}

// What a file of these words is refused as.
std::string refusal_of(const fs::path& file, std::string_view words) {
  write_file_atomically(file, words);
  try {
    VideoReader reader(file);
  } catch (const BadDataError& error) {
    return error.what();
  }
  return "nothing: it is read";
}

TEST(VideoReader, OpensNoOtherFileThanTheOneThatIsGiven) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "clip.mp4";
  const std::string other = real_clip().string();
  EXPECT_THAT(refusal_of(file, "#EXTM3U\n#EXT-X-TARGETDURATION:10\n#EXTINF:1,\n" + other +
                                   "\n#EXT-X-ENDLIST\n"),
              testing::HasSubstr("an HLS playlist"));
  EXPECT_THAT(refusal_of(file, "ffconcat version 1.0\nfile '" + other + "'\n"),
              testing::HasSubstr("a list of files"));
  EXPECT_THAT(refusal_of(file,
                         "<?xml version=\"1.0\"?>\n<MPD xmlns=\"urn:mpeg:dash:schema:mpd:2011\" "
                         "profiles=\"urn:mpeg:dash:profile:isoff-main:2011\"></MPD>\n"),
              testing::HasSubstr("a DASH manifest"));
  EXPECT_THAT(refusal_of(file,
                         "v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nc=IN IP4 127.0.0.1\nt=0 0\n"
                         "m=video 5004 RTP/AVP 96\n"),
              testing::HasSubstr("the description of a stream"));
  EXPECT_THAT(refusal_of(folder.path() / "frame%03d.png", "no picture"),
              testing::HasSubstr("a pattern of file names"));
}

TEST(VideoReader, TakesNoPartOfANameForAProtocol) {
  if (!fs::exists(real_clip())) GTEST_SKIP() << "real data is missing: " << real_clip();
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "concat:http:clip.mp4";
  fs::create_symlink(real_clip(), file);
  const fs::path here = fs::current_path();
  fs::current_path(folder.path());
  StoredPicture frame;
  EXPECT_TRUE(VideoReader(file.filename()).next(frame));
  fs::current_path(here);
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
    EXPECT_THAT(error.what(), testing::HasSubstr("the frames before it are good"));
  }
}

TEST(VideoReader, BeforeTheFirstFrameNoneIsGood) {
  if (!fs::exists(real_clip())) GTEST_SKIP() << "real data is missing: " << real_clip();
  const TemporaryFolder folder;
  std::vector<std::byte> whole = read_file(real_clip());
  std::fill(whole.begin() + 4096, whole.end() - 65536, std::byte{0});  // the index stays whole
  const fs::path blank = folder.path() / "blank.mp4";
  write_file_atomically(blank, std::span<const std::byte>(whole));
  try {
    StoredPicture frame;
    EXPECT_FALSE(VideoReader(blank).next(frame));
    FAIL() << "a frame of zeros is read";
  } catch (const BadDataError& error) {
    EXPECT_THAT(error.what(), testing::Not(testing::HasSubstr("are good")));
  }
}

}  // namespace
}  // namespace organbake
