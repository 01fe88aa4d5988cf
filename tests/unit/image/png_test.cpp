// SPDX-License-Identifier: Apache-2.0
#include "organbake/image/png.h"

#include <gtest/gtest.h>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/random.h"
#include "organbake/core/temporary_folder.h"

namespace organbake {
namespace {

Rgb8Image noise(int width, int height) {
  Rgb8Image image(width, height);
  RandomStream random(2);
  for (auto& p : image.pixels) p = static_cast<std::uint8_t>(random.below(256));
  return image;
}

TEST(Png, RoundTripIsExact) {
  const TemporaryFolder folder;
  for (const auto& [w, h] : {std::pair{1, 1}, {7, 3}, {64, 48}}) {
    const Rgb8Image image = noise(w, h);
    for (const int level : {0, 1, 6, 9}) {
      write_png(folder.path() / "a.png", image, level);
      const Rgb8Image back = read_png(folder.path() / "a.png");
      EXPECT_EQ(back.width, w);
      EXPECT_EQ(back.pixels, image.pixels);
    }
  }
}

TEST(Png, SameImageSameBytes) {
  const TemporaryFolder folder;
  write_png(folder.path() / "a.png", noise(30, 20));
  write_png(folder.path() / "b.png", noise(30, 20));
  EXPECT_EQ(read_file(folder.path() / "a.png"), read_file(folder.path() / "b.png"));
}

TEST(Png, RefusesWhatIsNone) {
  const TemporaryFolder folder;
  EXPECT_THROW(read_png(folder.path() / "missing.png"), NoInputError);
  write_file_atomically(folder.path() / "text.png", "not a picture");
  EXPECT_THROW(read_png(folder.path() / "text.png"), BadDataError);
  write_png(folder.path() / "a.png", noise(64, 64));
  EXPECT_THROW(read_png(folder.path() / "a.png", 64 * 63), BadDataError);
  auto bytes = read_file(folder.path() / "a.png");
  bytes.resize(bytes.size() / 2);
  write_file_atomically(folder.path() / "half.png", bytes);
  EXPECT_THROW(read_png(folder.path() / "half.png"), BadDataError);
  EXPECT_THROW(write_png(folder.path() / "empty.png", Rgb8Image()), IoError);
}

}  // namespace
}  // namespace organbake
