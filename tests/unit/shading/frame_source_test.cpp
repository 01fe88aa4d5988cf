// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/frame_source.h"

#include <gmock/gmock.h>

#include "organbake/core/error.h"

namespace organbake {
namespace {

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

}  // namespace
}  // namespace organbake
