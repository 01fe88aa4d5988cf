// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/frame_source.h"

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/temporary_files.h"
#include "organbake/phantom/laparoscopy.h"
#include "organbake/shading/prepared_frame.h"
#include "support/error_message.h"
#include "support/places.h"
#include "support/testing.h"

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
  return message_of(ExitCode::bad_data, [&] { VideoReader reader(file); });
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

// Grey stripes whose contrast tells the sharpness, shifted so that no two are alike.
Rgb8Image stripes(int contrast, int shift) {
  Rgb8Image image(32, 16);
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 32; ++x)
      for (int c = 0; c < 3; ++c)
        image.at(x, y)[c] = static_cast<std::uint8_t>(100 + shift + ((x / 2) % 2 ? contrast : 0));
  return image;
}

FrameSelection::NextFrame clip(std::vector<Rgb8Image> frames, bool damaged_at_the_end = false) {
  return [frames, damaged_at_the_end, at = std::size_t{0}](StoredPicture& image) mutable {
    if (at == frames.size()) {
      if (damaged_at_the_end) throw BadDataError("frame " + std::to_string(at) + ": cut off");
      return false;
    }
    image = frames[at++];
    return true;
  };
}

std::vector<std::size_t> indices(FrameSelection& selection) {
  std::vector<std::size_t> found;
  while (auto frame = selection.next()) found.push_back(frame->index);
  return found;
}

TEST(FrameSelection, EveryNth) {
  std::vector<Rgb8Image> frames;
  for (int i = 0; i < 7; ++i) frames.push_back(stripes(50, 5 * i));
  FrameSelection selection(clip(frames), {.every = 3});
  EXPECT_THAT(indices(selection), testing::ElementsAre(0, 3, 6));
  EXPECT_EQ(selection.frames_read(), 7u);
}

TEST(FrameSelection, TheSharpestOfEachGroup) {
  FrameSelection selection(
      clip({stripes(10, 0), stripes(90, 3), stripes(20, 6), stripes(80, 9), stripes(15, 12)}),
      {.every = 3, .sharpest = true});
  EXPECT_THAT(indices(selection), testing::ElementsAre(1, 3));
  EXPECT_EQ(selection.blurred(), 3u);
}

TEST(FrameSelection, DuplicatesAreSkippedAndCounted) {
  FrameSelection selection(clip({stripes(50, 0), stripes(50, 0), stripes(50, 9)}), {});
  EXPECT_THAT(indices(selection), testing::ElementsAre(0, 2));
  EXPECT_EQ(selection.duplicates(), 1u);
}

TEST(FrameSelection, DamageEndsTheClipAndIsTold) {
  FrameSelection selection(clip({stripes(50, 0), stripes(50, 9)}, true), {});
  EXPECT_THAT(indices(selection), testing::ElementsAre(0, 1));
  EXPECT_THAT(selection.damage(), testing::HasSubstr("frame 2: cut off"));
}

StoredPicture numbered(int width, int height) {
  StoredPicture picture(Rgb8Image(width, height));
  for (std::size_t i = 0; i < picture.color.pixels.size(); ++i) {
    picture.color.pixels[i] = static_cast<std::uint8_t>(5 * i);
    picture.linear.push_back(static_cast<float>(i));
  }
  return picture;
}

// Where Exif says that the stored pixel (x, y) is seen.
std::pair<int, int> seen_at(Turn turn, int x, int y, int width, int height) {
  switch (turn) {
    case Turn::none:
      return {x, y};
    case Turn::mirror:
      return {width - 1 - x, y};
    case Turn::half:
      return {width - 1 - x, height - 1 - y};
    case Turn::flip:
      return {x, height - 1 - y};
    case Turn::transpose:
      return {y, x};
    case Turn::clockwise:
      return {height - 1 - y, x};
    case Turn::transverse:
      return {height - 1 - y, width - 1 - x};
    case Turn::counterclockwise:
      return {y, width - 1 - x};
  }
  return {};
}

TEST(Upright, EveryTurnPutsPixelsWhereExifSays) {
  for (int value = 1; value <= 8; ++value) {
    const StoredPicture stored = numbered(5, 3);
    StoredPicture picture = stored;
    picture.turn = static_cast<Turn>(value);
    const PixelSize size = upright_size(picture);
    make_upright(picture);
    ASSERT_EQ((PixelSize{picture.color.width, picture.color.height}), size);
    ASSERT_EQ(size.width, value >= 5 ? 3 : 5);
    for (int y = 0; y < 3; ++y)
      for (int x = 0; x < 5; ++x) {
        const auto [u, v] = seen_at(static_cast<Turn>(value), x, y, 5, 3);
        EXPECT_EQ(picture.color.at(u, v)[1], stored.color.at(x, y)[1]) << "turn " << value;
        EXPECT_EQ(picture.linear[3 * (std::size_t(v) * size.width + u)],
                  stored.linear[3 * (std::size_t(y) * 5 + x)]);
      }
    EXPECT_EQ(picture.turn, Turn::none);
  }
}

TEST(Upright, OblongPixelsBecomeSquareByDividingThem) {
  StoredPicture wide = numbered(20, 30), high = wide, odd = wide;
  wide.pixel_aspect = 2;
  make_upright(wide);
  EXPECT_EQ(wide.color.width, 40);
  EXPECT_EQ(wide.color.height, 30);
  high.pixel_aspect = 0.5;
  make_upright(high);
  EXPECT_EQ(high.color.width, 20);
  EXPECT_EQ(high.color.height, 60);
  EXPECT_EQ(high.linear.size(), 3u * 20 * 60);
  odd.pixel_aspect = 300;
  EXPECT_THROW(make_upright(odd), BadDataError);
}

TEST(StereoFrame, TwoEyesInOneFrameAreNoticedAndOneEyeIsNot) {
  const LaparoscopyPhantom phantom({.width = 320, .height = 240, .frames = 40});
  const Rgb8Image left = phantom.frame(0).image, right = phantom.frame(1).image;  // a little aside
  EXPECT_EQ(find_stereo_layout(left), StereoLayout::none);
  Rgb8Image beside(640, 240), below(320, 480);
  for (int y = 0; y < 240; ++y) {
    std::copy_n(left.at(0, y), 960, beside.at(0, y));
    std::copy_n(right.at(0, y), 960, beside.at(320, y));
  }
  std::copy(left.pixels.begin(), left.pixels.end(), below.pixels.begin());
  std::copy(right.pixels.begin(), right.pixels.end(), below.at(0, 240));
  EXPECT_EQ(find_stereo_layout(beside), StereoLayout::side_by_side);
  EXPECT_EQ(find_stereo_layout(below), StereoLayout::top_bottom);
}

// Two fields of a grey disc, `apart` pixels to the right of each other.
Rgb8Image two_fields(int apart) {
  Rgb8Image image(160, 120);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) {
      const double right = x - 80 - (y % 2 ? apart : 0);
      std::fill_n(image.at(x, y), 3, std::uint8_t(std::hypot(right, y - 60) < 40 ? 180 : 60));
    }
  return image;
}

TEST(Combs, AreOfTwoFieldsAndNotOfAPalettesDither) {
  EXPECT_TRUE(is_combed(two_fields(6)));
  EXPECT_FALSE(is_combed(two_fields(0)));
  // A slow slope in a palette of six greys, its rest spread to the neighbours (Floyd & Steinberg).
  Rgb8Image dithered(160, 120);
  Plane rest(161, 121);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) {
      const float wanted = 60 + 0.7F * static_cast<float>(x) + rest.at(x, y);
      const float level = 50 * std::round(wanted / 50), left = wanted - level;
      std::fill_n(dithered.at(x, y), 3, static_cast<std::uint8_t>(level));
      rest.at(x + 1, y) += left * 7 / 16;
      rest.at(x, y + 1) += left * 5 / 16;
      if (x > 0) rest.at(x - 1, y + 1) += left * 3 / 16;
      rest.at(x + 1, y + 1) += left / 16;
    }
  EXPECT_FALSE(is_combed(dithered));
  // An ordered one: every second pixel of every second row.
  Rgb8Image ordered(160, 120);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x)
      std::fill_n(ordered.at(x, y), 3, std::uint8_t((x + y) % 2 ? 100 : 140));
  EXPECT_FALSE(is_combed(ordered));
}

TEST(Brightness, OfAStroboscopeJumpsAndThatOfAnExposureGoesAlong) {
  EXPECT_NEAR(brightness(two_fields(0)), 60 + 120 * 3.14159 * 40 * 40 / (160 * 120), 1);
  std::vector<double> strobe, exposure, cuts;
  for (int i = 0; i < 30; ++i) {
    strobe.push_back(i % 2 ? 90 : 20);
    exposure.push_back(60 * std::exp(0.5 * std::sin(0.4 * i)));
    cuts.push_back(i / 10 == 1 ? 20 : 90);
  }
  EXPECT_TRUE(flickers(strobe));
  EXPECT_FALSE(flickers(exposure));
  EXPECT_FALSE(flickers(cuts));
  EXPECT_FALSE(flickers({}));
}

TEST(Squares, OfAMosaicAreMeasured) {
  const Rgb8Image plain = LaparoscopyPhantom({.width = 320, .height = 240}).frame(0).image;
  EXPECT_EQ(squares_px(plain), 1);
  for (const int side : {2, 5, 8, 16}) {
    Rgb8Image coarse = plain;
    for (int y = 0; y < 240; ++y)
      for (int x = 0; x < 320; ++x)
        std::copy_n(plain.at(x - x % side, y - y % side), 3, coarse.at(x, y));
    EXPECT_EQ(squares_px(coarse), side);
  }
  EXPECT_EQ(squares_px(Rgb8Image(64, 48)), 1) << "of one colour";
}

}  // namespace
}  // namespace organbake
