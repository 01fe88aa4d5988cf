// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/fast_sweeping.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organbake/phantom/known_answers.h"

namespace organbake {
namespace {

TEST(FastSweeping, RangesKeptInEitherPrecisionAgree) {
  const NearScene scene = near_scene(0.5, 48);
  Plane logs = scene.intensity;
  for (float& value : logs.values) value = std::log(value);
  Plane single = farthest_log_range(logs);
  Grid<double> exact(logs.width, logs.height);
  for (std::size_t k = 0; k < exact.size(); ++k) exact.values[k] = single.values[k];
  const Mask inside(logs.width, logs.height, 1);
  constexpr int kMostSweeps = 200;
  constexpr double kTolerance = 1e-6;
  sweep_log_range(logs, inside, ray_grid(scene.camera), single, kMostSweeps, kTolerance);
  sweep_log_range(logs, inside, ray_grid(scene.camera), exact, kMostSweeps, kTolerance);
  // Rounding moves a pixel by 1e-7; where the upwind neighbour changes with it, by more.
  constexpr double kAgree = 1e-3;
  for (std::size_t k = 0; k < exact.size(); ++k)
    ASSERT_NEAR(single.values[k], exact.values[k], kAgree) << k;
}

}  // namespace
}  // namespace organbake
