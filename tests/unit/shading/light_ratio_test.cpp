// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/laparoscope.h"

#include <gmock/gmock.h>

#include "known_depth.h"
#include "organbake/core/error.h"
#include "organbake/shading/light_ratio.h"

namespace organbake {
namespace {

// What a light beside the lens makes of a scene.
Plane lit_from_beside(const NearScene& scene, const LaparoscopeOptions& options) {
  const Plane ratio = light_ratio(scene.log_range, ray_grid(scene.camera), options);
  Plane intensity = scene.intensity;
  for (std::size_t k = 0; k < ratio.size(); ++k) intensity.values[k] *= ratio.values[k];
  return intensity;
}

double median_range(const NearScene& scene) {
  std::vector<float> values = scene.log_range.values;
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return std::exp(values[values.size() / 2]);
}

TEST(OffsetLight, RatioIsOneForACentralEvenLight) {
  const NearScene scene = near_scene(0.5, 32);
  const Plane ratio = light_ratio(scene.log_range, ray_grid(scene.camera), {});
  for (float value : ratio.values) EXPECT_FLOAT_EQ(value, 1);
}

TEST(OffsetLight, KnowingTheOffsetBringsTheErrorDown) {
  const NearScene scene = near_scene(0.5, 96);
  const Mask inside(96, 96, 1);
  for (double offset : {2.0, 5.0, 10.0}) {
    const LaparoscopeOptions options{.light_offset_x_mm = offset};
    const Plane intensity = lit_from_beside(scene, options);
    const RangeEstimate ignorant = shade_laparoscope(intensity, inside, scene.camera, {});
    const RangeEstimate told =
        shade_laparoscope(intensity, inside, scene.camera, options, nullptr, median_range(scene));
    const double error = relative_error_percent(told.log_range, scene.log_range);
    EXPECT_LT(error, 0.5 * relative_error_percent(ignorant.log_range, scene.log_range)) << offset;
    EXPECT_LT(error, 0.1 + 0.1 * offset) << offset;
  }
}

TEST(OffsetLight, BeamProfileIsTakenOut) {
  const NearScene scene = near_scene(0.5, 96);
  const LaparoscopeOptions options{.beam_exponent = 3};
  const RangeEstimate told =
      shade_laparoscope(lit_from_beside(scene, options), Mask(96, 96, 1), scene.camera, options);
  EXPECT_LT(relative_error_percent(told.log_range, scene.log_range), 0.3);
}

TEST(OffsetLight, AnOffsetNeedsARange) {
  const NearScene scene = near_scene(0.5, 32);
  EXPECT_THROW(
      shade_laparoscope(scene.intensity, Mask(32, 32, 1), scene.camera, {.light_offset_x_mm = 3}),
      UsageError);
}

}  // namespace
}  // namespace organbake
