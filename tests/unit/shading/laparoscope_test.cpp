// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/laparoscope.h"

#include <gmock/gmock.h>

#include "known_depth.h"
#include "organbake/core/error.h"
#include "organbake/shading/ray_grid.h"

namespace organbake {
namespace {

RangeEstimate shade(const NearScene& scene, const LaparoscopeOptions& options = {},
                    const RangeEstimate* previous = nullptr) {
  const Mask inside(scene.camera.width, scene.camera.height, 1);
  return shade_laparoscope(scene.intensity, inside, scene.camera, options, previous);
}

Plane flat_plane(const NearScene& scene) {
  Plane v(scene.camera.width, scene.camera.height);
  const RayGrid rays = ray_grid(scene.camera);
  for (int y = 0; y < v.height; ++y)
    for (int x = 0; x < v.width; ++x)
      v.at(x, y) =
          static_cast<float>(0.5 * std::log1p(rays.x(x) * rays.x(x) + rays.y(y) * rays.y(y)));
  return v;
}

TEST(Laparoscope, DefaultsAreValidAndBoundsAreChecked) {
  EXPECT_NO_THROW(LaparoscopeOptions().check());
  EXPECT_THROW((LaparoscopeOptions{.light_offset_x_mm = 60}.check()), UsageError);
  EXPECT_THROW((LaparoscopeOptions{.beam_exponent = -1}.check()), UsageError);
  EXPECT_THROW((LaparoscopeOptions{.texture = 0}.check()), UsageError);
}

// The figure promised: 0.25 % on clean images, the same at any resolution.
TEST(Laparoscope, CleanSurfacesWithinAQuarterPercent) {
  for (const auto& [amplitude, size] :
       {std::pair{0.25, 128}, std::pair{0.5, 128}, std::pair{1.0, 128}, std::pair{1.0, 256}}) {
    const NearScene scene = near_scene(amplitude, size);
    const RangeEstimate estimate = shade(scene);
    EXPECT_LT(relative_error_percent(estimate.log_range, scene.log_range), 0.25)
        << "A = " << amplitude << ", " << size;
  }
}

// The figures promised, the steepest surface at 128² among them, where a tenth of the image is
// darker than the noise; organbench has all sizes.
TEST(Laparoscope, NoisySurfacesWithinTheirFigures) {
  for (const auto& [noise, figure] : {std::pair{0.01, 0.5}, std::pair{0.03, 1.0}})
    for (double amplitude : {0.25, 0.5, 1.0})
      for (int size : {128, 256}) {
        NearScene scene = near_scene(amplitude, size);
        add_noise(scene.intensity, noise, true, 5);
        EXPECT_LT(relative_error_percent(shade(scene).log_range, scene.log_range), figure)
            << "noise " << noise << ", A = " << amplitude << ", " << size;
      }
}

TEST(Laparoscope, AccuracyDoesNotFallWithResolution) {
  double last = 1e9;
  for (int size : {64, 128, 256}) {
    NearScene scene = near_scene(0.5, size);
    add_noise(scene.intensity, 0.03, true, 9);
    const double error = relative_error_percent(shade(scene).log_range, scene.log_range);
    EXPECT_LT(error, last) << size;
    last = error;
  }
}

TEST(Laparoscope, BeatsFlatPlaneAndBareSweeping) {
  NearScene scene = near_scene(1, 128);
  add_noise(scene.intensity, 0.01, true, 3);
  const double error = relative_error_percent(shade(scene).log_range, scene.log_range);
  const RangeEstimate swept = shade(scene, {.refine = false});
  EXPECT_GT(swept.sweeps, 0);
  EXPECT_LT(error, relative_error_percent(swept.log_range, scene.log_range));
  EXPECT_LT(error, 0.1 * relative_error_percent(flat_plane(scene), scene.log_range));
}

TEST(Laparoscope, PreviousFrameSavesAllSweeps) {
  NearScene first = near_scene(0.5, 128), second = near_scene(0.53, 128);  // it has moved
  add_noise(first.intensity, 0.01, true, 1);
  add_noise(second.intensity, 0.01, true, 2);
  const RangeEstimate cold = shade(first);
  const RangeEstimate warm = shade(second, {}, &cold);
  EXPECT_TRUE(warm.warm);
  EXPECT_EQ(warm.sweeps, 0);
  EXPECT_GT(warm.refinements, 0);
  EXPECT_LT(warm.refinements, cold.refinements / 2);
  EXPECT_LT(relative_error_percent(warm.log_range, second.log_range), 0.5);
}

TEST(Laparoscope, NoiseAloneDoesNotMoveTheDepth) {
  const NearScene still = near_scene(0.5, 128);
  NearScene noisy = still;
  add_noise(noisy.intensity, 0.01, true, 1);
  const RangeEstimate first = shade(noisy);
  RangeEstimate last = first;
  for (std::uint64_t seed = 2; seed < 12; ++seed) {
    noisy = still;
    add_noise(noisy.intensity, 0.01, true, seed);
    last = shade(noisy, {}, &last);
    EXPECT_EQ(last.refinements, 0) << seed;
  }
  EXPECT_EQ(last.log_range, first.log_range);
}

TEST(Laparoscope, OneSpotThatMovesIsSeen) {
  NearScene scene = near_scene(0.5, 128);
  add_noise(scene.intensity, 0.01, true, 1);
  const RangeEstimate cold = shade(scene);
  for (int y = 60; y < 66; ++y)
    for (int x = 60; x < 66; ++x) scene.intensity.at(x, y) *= 1.1F;
  EXPECT_GT(shade(scene, {}, &cold).refinements, 0);
}

TEST(Laparoscope, AlbedoMakesItMetric) {
  NearScene scene = near_scene(0.5, 128);
  // Brightest pixel 1 = ρ cosθ / r²: ρ from one pixel of the truth at the nearest, frontal point.
  const auto nearest =
      std::min_element(scene.log_range.values.begin(), scene.log_range.values.end());
  const std::size_t k = static_cast<std::size_t>(nearest - scene.log_range.values.begin());
  const double albedo = scene.intensity.values[k] * std::exp(2.0 * *nearest);
  const RangeEstimate estimate = shade(scene);
  const double shift = 0.5 * std::log(albedo / estimate.intensity_unit);
  EXPECT_NEAR(mean_of(estimate.log_range) + shift, mean_of(scene.log_range), 0.005);
}

TEST(Laparoscope, MirroredAndTransposedImagesGiveTheSameDepth) {
  NearScene scene = near_scene(0.5, 96);
  const Plane depth = shade(scene).log_range;
  NearScene other = scene;
  other.intensity = transposed(scene.intensity);
  // The order of summation differs; a thousandth of a percent of the range does not matter.
  EXPECT_LT(largest_difference(shade(other).log_range, transposed(depth)), 2e-3);
  other.intensity = mirrored(scene.intensity);
  EXPECT_LT(largest_difference(shade(other).log_range, mirrored(depth)), 2e-3);
}

TEST(Laparoscope, MaskedPixelsAreBridged) {
  NearScene scene = near_scene(0.5, 128);
  Mask inside(128, 128, 1);
  for (int y = 40; y < 52; ++y)
    for (int x = 60; x < 74; ++x) {
      inside.at(x, y) = 0;
      scene.intensity.at(x, y) = 5;  // a highlight
    }
  const RangeEstimate estimate = shade_laparoscope(scene.intensity, inside, scene.camera, {});
  EXPECT_LT(relative_error_percent(estimate.log_range, scene.log_range), 0.35);
  const double shift = mean_of(scene.log_range) - mean_of(estimate.log_range);
  for (int y = 40; y < 52; ++y)
    for (int x = 60; x < 74; ++x)
      EXPECT_NEAR(estimate.log_range.at(x, y) + shift, scene.log_range.at(x, y), 0.03);
}

TEST(Laparoscope, RefusesPlanesOfAnotherSize) {
  const NearScene scene = near_scene(0.5, 32);
  EXPECT_THROW(shade_laparoscope(Plane(31, 32), Mask(32, 32, 1), scene.camera, {}), BadDataError);
}

}  // namespace
}  // namespace organbake
