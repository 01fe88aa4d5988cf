// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/tissue_appearance.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "organbake/core/random.h"

namespace organbake {
namespace {

// A square of mottled tissue whose outermost pixels glow by so many levels, as in a frame beside
// brighter tissue.
TissuePicture square_of_tissue(int glow) {
  constexpr int kSize_px = 240, kSide_px = 180, kFirst = (kSize_px - kSide_px) / 2;
  TissuePicture picture{Rgb8Image(kSize_px, kSize_px), {}, TissueAppearance::kGrain_mm};
  RandomStream random(3);
  for (int y = 0; y < kSize_px; ++y)
    for (int x = 0; x < kSize_px; ++x) {
      const int inside =
          std::min({x - kFirst, y - kFirst, kFirst + kSide_px - 1 - x, kFirst + kSide_px - 1 - y});
      picture.mask.push_back(inside >= 0);
      const int level = 80 + static_cast<int>(random.below(30)) + (inside == 0 ? glow : 0);
      for (int c = 0; c < 3; ++c) picture.image.at(x, y)[c] = std::uint8_t(level);
    }
  return picture;
}

TEST(TissueAppearance, ABandIsThatOfTheTissueNotOfItsRim) {
  const TissueAppearance plain = appearance_of(square_of_tissue(0)),
                         beside = appearance_of(square_of_tissue(50));
  for (int k = 0; k < TissueAppearance::kOctaves; ++k) {
    EXPECT_NEAR(beside.energy[k], plain.energy[k], 0.35);
    EXPECT_NEAR(beside.kurtosis[k], plain.kurtosis[k], 0.2 * plain.kurtosis[k]);
  }
}

}  // namespace
}  // namespace organbake
