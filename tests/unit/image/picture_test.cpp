// SPDX-License-Identifier: Apache-2.0
#include "organbake/image/png.h"

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/random.h"
#include "organbake/core/temporary_files.h"
#include "organbake/image/difference.h"
#include "organbake/image/srgb.h"
#include "support/testing.h"

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

TEST(Srgb, EveryByteComesBack) {
  for (int i = 0; i < 256; ++i) EXPECT_EQ(srgb8_from_linear(linear_from_srgb8()[i]), i);
}

// The bytes come from a table of the formula's steps.
TEST(Srgb, BytesAreTheFormulasToTheBit) {
  const auto formula = [](float linear) { return int(255 * srgb_from_linear(linear) + 0.5f); };
  constexpr int kPlaces = 1 << 20;
  for (int i = 0; i <= kPlaces; ++i) {
    const float linear = static_cast<float>(i) / kPlaces, below = std::nextafter(linear, 0.0f);
    ASSERT_EQ(srgb8_from_linear(linear), formula(linear)) << linear;
    ASSERT_EQ(srgb8_from_linear(below), formula(below)) << below;
  }
}

TEST(Srgb, KnownValues) {  // IEC 61966-2-1
  EXPECT_NEAR(linear_from_srgb(0.5f), 0.21404f, 1e-5);
  EXPECT_NEAR(srgb_from_linear(0.18f), 0.46136f, 1e-5);
}

TEST(Srgb, ClampsWhatCannotBeShown) {
  EXPECT_EQ(srgb8_from_linear(-1), 0);
  EXPECT_EQ(srgb8_from_linear(2), 255);
  EXPECT_EQ(srgb8_from_linear(std::numeric_limits<float>::quiet_NaN()), 0);
}

Rgb8Image grey(int value, int noise = 0) {
  Rgb8Image image(40, 30);
  RandomStream random(6);
  for (auto& p : image.pixels)
    p = static_cast<std::uint8_t>(value + static_cast<int>(random.below(2 * noise + 1)) - noise);
  return image;
}

TEST(CompareImages, KnowsEqualAndConstantOffset) {
  EXPECT_TRUE(std::isinf(compare_images(grey(9), grey(9)).psnr_db));
  const ImageDifference d = compare_images(grey(100), grey(105));
  EXPECT_EQ(d.mean_abs, 5);
  EXPECT_EQ(d.max_abs, 5);
  EXPECT_NEAR(d.psnr_db, 20 * std::log10(255.0 / 5), 1e-9);
  EXPECT_EQ(d.pixels, 1200u);
}

TEST(CompareImages, LooksOnlyWhereTheMaskSays) {
  Rgb8Image a = grey(10), b = grey(10);
  b.at(5, 5)[1] = 200;
  std::vector<std::uint8_t> mask(1200, 1);
  mask[5 * 40 + 5] = 0;
  EXPECT_EQ(compare_images(a, b, mask).max_abs, 0);
  EXPECT_EQ(compare_images(a, b).max_abs, 190);
}

TEST(CompareImages, RefusesUnequalSizes) {
  EXPECT_THROW(compare_images(grey(1), Rgb8Image(4, 4)), BadDataError);
  EXPECT_THROW(structural_similarity(grey(1), Rgb8Image(4, 4)), BadDataError);
}

TEST(StructuralSimilarity, IsOneForEqualAndFallsWithNoise) {
  const Rgb8Image a = grey(120, 40);
  EXPECT_NEAR(structural_similarity(a, a), 1, 1e-9);
  const double little = structural_similarity(grey(120, 2), grey(120)),
               much = structural_similarity(a, grey(120));
  EXPECT_GT(little, much);
  EXPECT_LT(much, 0.3);  // a flat picture shares no structure with noise
}

}  // namespace
}  // namespace organbake
