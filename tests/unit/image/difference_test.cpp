// SPDX-License-Identifier: Apache-2.0
#include "organbake/image/difference.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/random.h"

namespace organbake {
namespace {

Rgb8Image grey(int value, int noise = 0) {
  Rgb8Image image(40, 30);
  RandomStream random(6);
  for (auto& p : image.pixels) {
    p = static_cast<std::uint8_t>(value + static_cast<int>(random.below(2 * noise + 1)) - noise);
  }
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
