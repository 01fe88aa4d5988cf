// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/tsai_shah.h"

#include <gmock/gmock.h>

#include <numbers>

#include "known_depth.h"
#include "organbake/core/error.h"

namespace organbake {
namespace {

// The paper's formulae in p_s, q_s as printed, with the stable gain; written from the page alone.
std::vector<double> transcription(const Plane& image, double tilt, double slant, int iterations) {
  const int w = image.width, h = image.height;
  const double ps = std::cos(tilt) * std::sin(slant) / std::cos(slant);
  const double qs = std::sin(tilt) * std::sin(slant) / std::cos(slant);
  std::vector<double> z(image.size(), 0.0), s(image.size(), 0.0);
  for (int n = 0; n < iterations; ++n) {
    std::vector<double> next(image.size());
    for (int i = 0; i < h * w; ++i) {
      double p = 0, q = 0;
      if (i % w > 0 && i / w > 0) {
        p = z[i] - z[i - 1];
        q = z[i] - z[i - w];
      }
      const double pq = 1 + p * p + q * q, light = 1 + ps * ps + qs * qs;
      const double r = (p * ps + q * qs + 1) / (std::sqrt(pq) * std::sqrt(light));
      const double f = image.values[i] - std::max(0.0, r);
      const double df =
          (p + q) * (p * ps + q * qs + 1) / (std::sqrt(pq * pq * pq) * std::sqrt(light)) -
          (ps + qs) / (std::sqrt(pq) * std::sqrt(light));
      s[i] += df * df;
      next[i] = z[i] - df / (1e-8 + s[i]) * f;
    }
    z = next;
  }
  return z;
}

TEST(TsaiShah, EqualsAnIndependentTranscription) {
  for (double tilt : {0.3, 2.0, -1.2})
    for (double slant : {0.2, 0.7, 1.2}) {
      const DistantScene scene = distant_scene("peaks", 48, {tilt, slant});
      const TsaiShahEstimate estimate =
          shade_tsai_shah(scene.intensity, {.light = {tilt, slant}, .iterations = 12});
      const std::vector<double> expected = transcription(scene.intensity, tilt, slant, 12);
      for (std::size_t k = 0; k < expected.size(); ++k)
        ASSERT_NEAR(estimate.depth.values[k], expected[k],
                    1e-9 * std::max(1.0, std::abs(expected[k])))
            << tilt << " " << slant << " pixel " << k;
    }
}

TEST(TsaiShah, StartsFromThePreviousFrame) {
  const DistantScene scene = distant_scene("gauss", 32, {0.5, 0.6});
  const TsaiShahEstimate once =
      shade_tsai_shah(scene.intensity, {.light = {0.5, 0.6}, .iterations = 4});
  const TsaiShahEstimate again =
      shade_tsai_shah(scene.intensity, {.light = {0.5, 0.6}, .iterations = 1}, &once.depth);
  EXPECT_LT(again.residual, once.residual * 1.5);
  EXPECT_NE(again.depth, once.depth);
  const Grid<double> other(5, 5);
  EXPECT_THROW(shade_tsai_shah(scene.intensity, {}, &other), BadDataError);
}

TEST(TsaiShah, SingularLightsLeaveTheDepthFinite) {
  constexpr double kPi = std::numbers::pi;
  for (double tilt : {0.0, 0.75 * kPi, -0.25 * kPi, 1.75 * kPi, kPi})
    for (double slant : {0.0, 0.5, 0.5 * kPi}) {
      const DistantScene scene = distant_scene("sphere", 24, {0.4, 0.6});
      const TsaiShahEstimate estimate =
          shade_tsai_shah(scene.intensity, {.light = {tilt, slant}, .iterations = 10000});
      for (double z : estimate.depth.values) ASSERT_LT(std::abs(z), 1e6) << tilt << " " << slant;
    }
}

TEST(TsaiShah, BoundsAreChecked) {
  EXPECT_NO_THROW(TsaiShahOptions().check());
  EXPECT_THROW((TsaiShahOptions{.light = {}, .iterations = 0}.check()), UsageError);
  EXPECT_THROW((TsaiShahOptions{.light = {NAN, 0}}.check()), UsageError);
}

}  // namespace
}  // namespace organbake
