// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/seams.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "organbake/bundle/bundle.h"

namespace organbake {
namespace {

constexpr int kSize = 64;

// Two faces side by side, everything covered, one grey.
TruthFrame two_faces() {
  TruthFrame truth;
  truth.color = Rgb8Image(kSize, kSize);
  std::fill(truth.color.pixels.begin(), truth.color.pixels.end(), std::uint8_t{100});
  truth.sharp = truth.color;
  truth.covered.assign(kSize * kSize, TruthFrame::kRaysPerPixel);
  for (int i = 0; i < kSize * kSize; ++i) truth.shell_face.push_back(i % kSize < kSize / 2 ? 3 : 7);
  return truth;
}

void brighten(Rgb8Image& image, int x0, int x1, int by) {
  for (int y = 0; y < kSize; ++y) {
    for (int x = x0; x < x1; ++x)
      image.at(x, y)[1] = static_cast<std::uint8_t>(image.at(x, y)[1] + by);
  }
}

TEST(EdgeSteps, FindASeamOfFive) {
  const TruthFrame truth = two_faces();
  Rgb8Image frame = truth.color;
  brighten(frame, kSize / 2, kSize, 5);
  const SeamSteps steps = edge_steps(frame, truth);
  EXPECT_EQ(steps.places, 1u);
  EXPECT_NEAR(steps.frame, 5, 1e-9);
  EXPECT_NEAR(steps.truth, 0, 1e-9);
  EXPECT_NEAR(steps.excess, 5, 1e-9);
}

TEST(EdgeSteps, DoNotBlameAStepThatTheTruthHas) {
  TruthFrame truth = two_faces();
  brighten(truth.sharp, kSize / 2, kSize, 30);
  EXPECT_NEAR(edge_steps(truth.sharp, truth).excess, 0, 1e-9);
}

TEST(EdgeSteps, LookAtFullyCoveredPixelsOnly) {
  TruthFrame truth = two_faces();
  for (int y = 0; y < kSize; ++y) truth.covered[y * kSize + kSize / 2] = 7;  // a silhouette there
  EXPECT_EQ(edge_steps(truth.color, truth).places, 0u);
}

TEST(SwitchSteps, FindAPatchThatJumps) {
  const TruthFrame truth = two_faces();
  Rgb8Image after = truth.color;
  brighten(after, 16, 32, 9);
  const SeamSteps steps = switch_steps(truth.color, after, truth, truth);
  EXPECT_EQ(steps.places, 64u);
  EXPECT_NEAR(steps.excess, 9, 1e-9);
}

}  // namespace
}  // namespace organbake
