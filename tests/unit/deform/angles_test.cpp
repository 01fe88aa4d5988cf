// SPDX-License-Identifier: Apache-2.0
#include "contact/padded_vector.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organbake/core/random.h"

namespace organbake::deform {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kPolynomial = 2e-11;  // of the angle: what angles_of promises
constexpr double kRounding = 1e-11;    // a small angle's sine has lost digits

PaddedVector at_angle(double radians) { return {std::cos(radians), std::sin(radians), 0, 0}; }

TEST(AnglesOf, AreTheArctangents) {
  RandomStream random(1);
  for (int i = 0; i < 10000; ++i) {
    Double4 sine, cosine;
    for (int lane = 0; lane < 4; ++lane) {
      const double size = std::pow(10, random.uniform(-12, 12)), at = random.uniform(0, kPi);
      sine[lane] = size * std::sin(at), cosine[lane] = size * std::cos(at);
    }
    const Double4 angles = angles_of(sine, cosine);
    for (int lane = 0; lane < 4; ++lane) {
      const double exact = std::atan2(sine[lane], cosine[lane]);
      EXPECT_NEAR(angles[lane], exact, kPolynomial * exact);
    }
  }
}

TEST(AnglesOf, AtTheEndsAndInTheMiddle) {
  const Double4 angles = angles_of(Double4{0, 0, 2, 1e-140}, Double4{3, -3, 0, 1e-140});
  const double exact[] = {0, kPi, kPi / 2, kPi / 4};
  for (int lane = 0; lane < 4; ++lane) EXPECT_NEAR(angles[lane], exact[lane], 4 * kPolynomial);
}

TEST(Angle, AddsUpToHalfATurn) {
  RandomStream random(2);
  for (int i = 0; i < 1000; ++i) {
    const double a = random.uniform(0, kPi), b = random.uniform(0, kPi);
    const Angle first = Angle::between(at_angle(0.3), at_angle(0.3 + a));
    const Angle second = Angle::between(at_angle(-b), at_angle(0));
    const Angle sum = first + second;
    EXPECT_NEAR(sum.cosine, std::cos(std::min(a + b, kPi)), kRounding);
    EXPECT_NEAR(wider(first, second).cosine, std::cos(std::max(a, b)), kRounding);
    EXPECT_EQ(sum.acute(), a + b < kPi / 2);
  }
  EXPECT_EQ((kHalfTurn + kNoAngle).cosine, -1);
  EXPECT_EQ((kHalfTurn + kHalfTurn).cosine, -1);
  EXPECT_FALSE((kHalfTurn + Angle::between(at_angle(0), at_angle(1))).acute());
}

}  // namespace
}  // namespace organbake::deform
