// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/log_range_fit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organbake/shading/grid_filters.h"

namespace organbake {
namespace {

// What leaks through a mask's rim is as small a part of a coarse level as of the frame.
TEST(LogRangeFit, MisfitIsTheFramesShareOfWhatAMaskHasMissed) {
  constexpr int kSide = 16, kLevels = 3, kStray = 4;
  constexpr float kBrighter = 1.5F, kVariance = 1e-4F;
  ShadedImage image{Plane(kSide, kSide, 1), Plane(kSide, kSide, kVariance), Mask(kSide, kSide, 1),
                    ray_grid({.width = kSide, .height = kSide, .fx = kSide, .fy = kSide})};
  for (int y = 0; y < kSide; ++y)
    for (int x = kSide / 2; x < kSide; ++x) image.inside.at(x, y) = 0;
  const int seen = kSide * kSide / 2;
  image.inside.at(kSide - 1, kStray) = 1;
  image.intensity.at(kSide - 1, kStray) = kBrighter;
  for (int level = 0; level < kLevels; ++level) {
    Plane v(image.rays.width, image.rays.height);  // ln r = 0: of brightness 1
    const double misfit = fit_log_range(image, {.outer_steps = 0}, v).misfit;
    EXPECT_NEAR(misfit, (kBrighter - 1) / std::sqrt(seen + 1.0), 1e-6) << "level " << level;
    image = halved(image);
  }
}

}  // namespace
}  // namespace organbake
