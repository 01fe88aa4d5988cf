// SPDX-License-Identifier: Apache-2.0
#include "organbake/core/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "organbake/core/quantile.h"
#include "organbake/core/smooth_step.h"

namespace organbake {
namespace {

TEST(RandomStream, BelongsToItsItem) {
  RandomStream a(7, 3), again(7, 3), other_item(7, 4), other_seed(8, 3);
  const auto first = a();
  EXPECT_EQ(first, again());
  EXPECT_NE(first, other_item());
  EXPECT_NE(first, other_seed());
}

TEST(RandomStream, IsFrozen) {
  // Phantoms and their baked bytes hang on these numbers.
  RandomStream stream(1, 2);
  const auto first = stream(), second = stream();
  RandomStream replay(1, 2);
  EXPECT_EQ(replay(), first);
  EXPECT_EQ(replay(), second);
  EXPECT_NE(first, second);
}

TEST(RandomStream, HasTheMomentsItPromises) {
  constexpr int kDraws = 200000;
  constexpr double kTolerance = 0.01;  // about 4.5 standard errors of the mean, 3 of the variance
  RandomStream stream(11);
  double mean = 0, normal_mean = 0, normal_square = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double u = stream.uniform(), n = stream.normal();
    ASSERT_GE(u, 0);
    ASSERT_LT(u, 1);
    ASSERT_TRUE(std::isfinite(n));
    mean += u / kDraws;
    normal_mean += n / kDraws;
    normal_square += n * n / kDraws;
  }
  EXPECT_NEAR(mean, 0.5, kTolerance);
  EXPECT_NEAR(normal_mean, 0, kTolerance);
  EXPECT_NEAR(normal_square, 1, kTolerance);
}

TEST(RandomStream, BelowReachesEveryValueEvenly) {
  std::array<int, 7> counts{};
  RandomStream stream(5);
  for (int i = 0; i < 70000; ++i) ++counts[stream.below(7)];
  for (const int count : counts) EXPECT_NEAR(count, 10000, 500);  // five standard deviations
}

TEST(Quantile, IsWhatSortingSays) {
  RandomStream random(5);
  std::vector<double> values;
  for (int k = 0; k < 101; ++k) values.push_back(random.uniform());
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(quantile(values, 0), sorted.front());
  EXPECT_EQ(quantile(values, 0.25), sorted[25]);
  EXPECT_EQ(quantile(values, 0.259), sorted[25]) << "the lower of two";
  EXPECT_EQ(quantile(values, 1), sorted.back());
  EXPECT_EQ(median(values), sorted[50]);
  EXPECT_EQ(quantile(std::vector<double>{}, 0.5), 0);
}

TEST(SmoothStep, RisesOrFallsBetweenItsEnds) {
  EXPECT_EQ(smooth_step(2, 4, 1), 0);
  EXPECT_EQ(smooth_step(2, 4, 3), 0.5);
  EXPECT_EQ(smooth_step(2, 4, 9), 1);
  EXPECT_EQ(smooth_step(4, 2, 2.5), 1 - smooth_step(2, 4, 2.5));
}

}  // namespace
}  // namespace organbake
