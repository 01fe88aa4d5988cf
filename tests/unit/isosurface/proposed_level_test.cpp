// SPDX-License-Identifier: GPL-3.0-or-later
#include "proposed_level.h"

#include <gmock/gmock.h>

#include <cmath>

#include "organbake/core/random.h"
#include "organbake/isosurface/isosurface.h"
#include "shape_volumes.h"

namespace organbake {
namespace {

TEST(ProposedLevel, LiesHalfWayBetweenAirAndTissue) {
  RandomStream random(3);
  Volume ct = scan_of(ball({0, 0, 0}, 15), grid_around_origin({1, 1, 1}, 50));
  for (std::int16_t& value : ct.voxels) {
    value = static_cast<std::int16_t>(value + std::lround(20 * random.normal()));
  }
  ct.voxels[7] = 3000;  // a clip of metal
  const ProposedLevel proposed = propose_level(ct);
  constexpr double kPeakWidth_hu = 10;  // of 20 HU of noise
  EXPECT_NEAR(proposed.low_peak_hu, -1000, kPeakWidth_hu);
  EXPECT_NEAR(proposed.high_peak_hu, 100, kPeakWidth_hu);
  EXPECT_NEAR(proposed.level_hu, -450, kPeakWidth_hu);
  EXPECT_THAT(proposed.reason(), ::testing::HasSubstr("half-way between the peaks at −"));
}

TEST(ProposedLevel, OfTwoSharpValuesIsTheirMiddle) {
  Volume ct;
  ct.size = {2, 2, 2};
  ct.voxels = {-1000, -1000, -1000, -1000, -1000, 61, 61, 61};
  EXPECT_EQ(propose_level(ct).low_peak_hu, -1000);
  EXPECT_EQ(propose_level(ct).high_peak_hu, 61);
  EXPECT_EQ(propose_level(ct).level_hu, -469.5);
}

TEST(ProposedLevel, NeedsTwoValues) {
  Volume ct;
  ct.size = {2, 2, 2};
  ct.voxels.assign(8, 40);
  EXPECT_THAT(message_of(ExitCode::bad_data, [&] { propose_level(ct); }),
              ::testing::HasSubstr("no level to propose"));
}

TEST(ProposedLevel, IsTakenAndTold) {
  std::string told;
  const RunContext context([&](LogLevel, std::string_view text) { told += text; }, {}, nullptr);
  const Volume ct = scan_of(ball({0, 0, 0}, 15), grid_around_origin({1, 1, 1}, 50));
  IsosurfaceOptions options;
  options.iso_hu = std::nullopt;
  const Isosurface surface = extract_isosurface(ct, options, context);
  EXPECT_NEAR(surface.level_hu, -450, 1);
  EXPECT_THAT(told, ::testing::HasSubstr("level −450, half-way between the peaks"));
  constexpr double kRadiusTolerance_mm = 0.02;  // as in isosurface_test
  EXPECT_LT(radius_rms(surface.mesh, 15), kRadiusTolerance_mm);
}

}  // namespace
}  // namespace organbake
