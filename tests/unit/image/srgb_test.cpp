// SPDX-License-Identifier: Apache-2.0
#include "organbake/image/srgb.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace organbake {
namespace {

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

}  // namespace
}  // namespace organbake
