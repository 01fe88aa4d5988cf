// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/beam_estimate.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organbake/shading/frame_albedo.h"
#include "stereo_scene.h"

namespace organbake {
namespace {

// Learned from what stereo finds in a few frames of a clip, as the stage does.
BeamEstimate learned(double beam_exponent, std::uint64_t seed, int frames) {
  LaparoscopyOptions options = stereo_scene(480, 384, seed);
  options.frames = frames;
  options.beam_exponent = beam_exponent;
  const LaparoscopyPhantom phantom(options);
  const Rectifier rectifier(rig_of(phantom));
  std::vector<BeamRings> rings;
  for (int i = 0; i < frames; ++i) {
    PreparedFrame left;
    const StereoDepth found =
        depth_of_pair(rectifier, phantom.frame(i).image, phantom.right_frame(i).image, &left);
    rings.push_back(beam_rings(left, found.depth.depth, found.depth.confidence));
  }
  return estimate_beam(rings);
}

// The phantom's own vignette of 5 % at the rim, 34° off the axis, is part of what is learned.
constexpr double kVignette = 0.27;

TEST(Beam, IsLearnedWithAnUncertaintyThatHolds) {
  constexpr double kMostOff = 0.6, kSigmas = 3;
  for (const std::uint64_t seed : {1U, 2U}) {
    for (const double exponent : {0.0, 4.0}) {
      const BeamEstimate beam = learned(exponent, seed, 2);
      const double off = std::abs(beam.exponent - exponent - kVignette);
      EXPECT_LT(off, kMostOff) << seed << ", cos^" << exponent << ": " << beam.exponent;
      EXPECT_LT(off, kSigmas * beam.sd + 0.1) << beam.exponent << " ± " << beam.sd;
      EXPECT_TRUE(beam.told() || exponent == 0) << beam.exponent << " ± " << beam.sd;
    }
  }
}

TEST(Beam, IsNotToldByNothing) {
  EXPECT_FALSE(estimate_beam({}).told());
  EXPECT_EQ(estimate_beam({}).sectors, 0);
  EXPECT_FALSE((BeamEstimate{.exponent = 1, .sd = 0.6, .sectors = 8}.told()));
  EXPECT_FALSE((BeamEstimate{.exponent = 4, .sd = 0.9, .sectors = 8}.told()));
  EXPECT_FALSE((BeamEstimate{.exponent = 4, .sd = 0.1, .sectors = 3}.told()));
  EXPECT_TRUE((BeamEstimate{.exponent = 4, .sd = 0.1, .sectors = 8}.told()));
}

// lighting.json as a calibration file: out and back.
TEST(Beam, PassesThroughALightingFile) {
  for (const double exponent : {0.0, 0.5, 2.0, 6.5}) {
    const LaparoscopeOptions lamp{
        .light_offset_x_mm = 2.5, .light_offset_y_mm = -1, .beam_exponent = exponent};
    const LaparoscopeOptions back =
        lamp_of(lighting_from_json(lighting_to_json(laparoscope_lighting(lamp)), "it"), "it");
    EXPECT_NEAR(back.beam_exponent, exponent, 1e-6);
    EXPECT_NEAR(back.light_offset_x_mm, 2.5, 1e-9);
    EXPECT_NEAR(back.light_offset_y_mm, -1, 1e-9);
  }
}

}  // namespace
}  // namespace organbake
