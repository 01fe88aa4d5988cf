// SPDX-License-Identifier: GPL-3.0-or-later
#include "appearance/ncc.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organbake/core/random.h"

namespace organbake {
namespace {

struct Values {
  std::vector<double> a, weights;
  Eigen::VectorXd b;
};

Values random_values(int count, std::uint64_t seed) {
  RandomStream random(seed);
  Values values{std::vector<double>(count), std::vector<double>(count), Eigen::VectorXd(count)};
  for (int i = 0; i < count; ++i) {
    values.a[i] = random.uniform();
    values.weights[i] = random.uniform();
    values.b[i] = 0.5 * values.a[i] + random.uniform();
  }
  return values;
}

// The paper's R, with weights, straight from its definition.
double plain_correlation(const Values& v) {
  double w = 0, ma = 0, mb = 0, ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < v.a.size(); ++i) {
    w += v.weights[i];
    ma += v.weights[i] * v.a[i];
    mb += v.weights[i] * v.b[i];
  }
  ma /= w;
  mb /= w;
  for (std::size_t i = 0; i < v.a.size(); ++i) {
    ab += v.weights[i] * (v.a[i] - ma) * (v.b[i] - mb);
    aa += v.weights[i] * (v.a[i] - ma) * (v.a[i] - ma);
    bb += v.weights[i] * (v.b[i] - mb) * (v.b[i] - mb);
  }
  return ab / std::sqrt(aa * bb);
}

constexpr double kRounding = 1e-12;

TEST(NccBlock, HalfTheSquaredResidualIsOneMinusR) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Values v = random_values(500, seed);
    const NccBlock block(v.a, v.weights);
    Eigen::VectorXd r(500);
    const double correlation = block.correlate(v.b, r.data());
    EXPECT_NEAR(correlation, plain_correlation(v), kRounding);
    EXPECT_NEAR(0.5 * r.squaredNorm(), 1 - correlation, kRounding);
  }
}

TEST(NccBlock, IsBlindToGainAndOffset) {
  Values v = random_values(300, 3);
  const NccBlock block(v.a, v.weights);
  const double before = block.correlate(v.b, nullptr);
  v.b = (7 * v.b.array() - 3).matrix();
  EXPECT_NEAR(block.correlate(v.b, nullptr), before, kRounding);
  v.b = -v.b;
  EXPECT_NEAR(block.correlate(v.b, nullptr), -before, kRounding);
}

TEST(NccBlock, DerivativeIsTheFiniteDifferences) {
  const Values v = random_values(200, 5);
  const NccBlock block(v.a, v.weights);
  const Eigen::VectorXd way = random_values(200, 6).b;
  NccBlock::RowMajor derivative(200, 1);
  derivative.col(0) = way;
  block.to_residual_derivative(v.b, derivative);
  constexpr double kStep = 1e-5;  // central: its error is of the order of the step squared
  Eigen::VectorXd before(200), after(200);
  block.correlate(v.b - kStep * way, before.data());
  block.correlate(v.b + kStep * way, after.data());
  EXPECT_LT(((after - before) / (2 * kStep) - derivative.col(0)).norm(),
            1e-8 * derivative.norm() + 1e-10);
}

TEST(NccBlock, ConstantsCorrelateWithNothing) {
  Values v = random_values(50, 7);
  const NccBlock block(v.a, v.weights);
  const Eigen::VectorXd flat = Eigen::VectorXd::Constant(50, 0.3);
  Eigen::VectorXd r(50);
  EXPECT_EQ(block.correlate(flat, r.data()), 0);
  EXPECT_NEAR(0.5 * r.squaredNorm(), 0.5, kRounding) << "half of ‖â‖²: there is no b̂ to take off";
  NccBlock::RowMajor derivative = NccBlock::RowMajor::Ones(50, 3);
  block.to_residual_derivative(flat, derivative);
  EXPECT_TRUE(derivative.isZero());
  EXPECT_FALSE(NccBlock(std::vector<double>(50, 0.2), v.weights).usable());
}

}  // namespace
}  // namespace organbake
