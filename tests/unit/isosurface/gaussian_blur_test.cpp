// SPDX-License-Identifier: GPL-3.0-or-later
#include "gaussian_blur.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace organbake {
namespace {

constexpr std::array<int, 3> kSize = {41, 43, 45};
constexpr std::size_t kCount = 41 * 43 * 45;

std::size_t at(int i, int j, int k) { return (std::size_t(k) * kSize[1] + j) * kSize[0] + i; }

TEST(GaussianBlur, OfAPointHasTheVariancesAskedFor) {
  std::vector<float> values(kCount, 0.0f);
  values[at(20, 21, 22)] = 1;
  const Eigen::Vector3d sigma(2, 1, 3);
  gaussian_blur(values, kSize, sigma);
  Eigen::Vector3d variance = Eigen::Vector3d::Zero();
  double sum = 0;
  for (int k = 0; k < kSize[2]; ++k) {
    for (int j = 0; j < kSize[1]; ++j) {
      for (int i = 0; i < kSize[0]; ++i) {
        const Eigen::Vector3d d(i - 20, j - 21, k - 22);
        sum += values[at(i, j, k)];
        variance += values[at(i, j, k)] * d.cwiseAbs2();
      }
    }
  }
  EXPECT_NEAR(sum, 1, 1e-5);
  for (int axis = 0; axis < 3; ++axis) {
    // The voxel's own width adds 1/12; the cut at 3 σ takes 3 % off.
    EXPECT_NEAR(variance[axis], sigma[axis] * sigma[axis], 0.04 * sigma[axis] * sigma[axis] + 0.09);
  }
}

TEST(GaussianBlur, KeepsConstantsToTheBorder) {
  std::vector<float> values(kCount, 0.75f);
  gaussian_blur(values, kSize, {2, 0.8, 5});
  for (const float v : values) ASSERT_NEAR(v, 0.75f, 1e-5);
}

TEST(GaussianBlur, OfAStepIsHalfAtTheStep) {
  std::vector<float> values(kCount, 0.0f);
  for (std::size_t v = 0; v < kCount; ++v) values[v] = v % kSize[0] >= 20 ? 1.0f : 0.0f;
  gaussian_blur(values, kSize, {1.5, 1.5, 1.5});
  EXPECT_NEAR(0.5 * (values[at(19, 21, 22)] + values[at(20, 21, 22)]), 0.5, 1e-5);
}

TEST(GaussianBlur, SigmaOfZeroChangesNothing) {
  std::vector<float> values(kCount);
  std::iota(values.begin(), values.end(), 0.0f);
  const std::vector<float> before = values;
  gaussian_blur(values, kSize, {0, 0, 0});
  EXPECT_EQ(values, before);
}

}  // namespace
}  // namespace organbake
