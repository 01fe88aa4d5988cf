// SPDX-License-Identifier: Apache-2.0
#include "solver/sparse_factor.h"

#include <gtest/gtest.h>

#include <cmath>

#include "contact/padded_vector.h"
#include "organbake/core/error.h"
#include "organbake/core/random.h"

namespace organbake::deform {
namespace {

// Relative: single precision's 6e-8 times some tens of additions; the matrices below have condition
// numbers < 1e3.
constexpr double kResidual = 1e-5;

// A seeded graph Laplacian plus a diagonal: what springs and masses make.
std::vector<Coefficient> random_system(std::uint32_t size, std::uint32_t edges,
                                       std::uint64_t seed) {
  RandomStream random(seed);
  std::vector<Coefficient> entries;
  for (std::uint32_t i = 0; i < size; ++i) entries.push_back({i, i, random.uniform(0.5, 2)});
  for (std::uint32_t e = 0; e < edges; ++e) {
    const auto a = static_cast<std::uint32_t>(random.below(size));
    const auto b = static_cast<std::uint32_t>(random.below(size));
    if (a == b) continue;
    const double k = random.uniform(0.1, 5);
    entries.push_back({a, a, k});
    entries.push_back({b, b, k});
    entries.push_back({a, b, -k});
  }
  return entries;
}

double relative_residual(std::uint32_t size, const std::vector<Coefficient>& entries,
                         std::uint64_t seed, UnknownOrder order = UnknownOrder::to_be_found) {
  const SparseFactor factor(size, entries, order);
  RandomStream random(seed);
  PaddedVectors right_side(size), solved(size);
  for (auto& row : right_side) {
    row = PaddedVector(random.normal(), random.normal(), random.normal(), random.normal());
  }
  for (std::uint32_t i = 0; i < size; ++i) solved[factor.position()[i]] = right_side[i];
  factor.solve(solved.data());
  PaddedVectors residual = right_side;
  double norm = 0, error = 0;
  for (const auto& [i, j, value] : entries) {
    residual[i] -= value * solved[factor.position()[j]];
    if (i != j) residual[j] -= value * solved[factor.position()[i]];
  }
  for (std::uint32_t i = 0; i < size; ++i) {
    norm += right_side[i].squaredNorm();
    error += residual[i].squaredNorm();
  }
  return std::sqrt(error / norm);
}

TEST(SparseFactor, SolvesSystemsOfEveryShape) {
  EXPECT_LT(relative_residual(1, {{0, 0, 4}}, 1), kResidual);
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    // From nearly diagonal (narrow panels) to nearly dense (panels at their widest).
    for (const std::uint32_t edges : {0u, 20u, 150u, 600u, 6000u}) {
      EXPECT_LT(relative_residual(150, random_system(150, edges, seed), seed), kResidual)
          << "seed " << seed << ", edges " << edges;
      EXPECT_LT(relative_residual(150, random_system(150, edges, seed), seed, UnknownOrder::given),
                kResidual)
          << "in the order given, seed " << seed << ", edges " << edges;
    }
  }
}

TEST(SparseFactor, SolvesPointsAlikeAloneAndInPairs) {
  constexpr std::uint32_t kSize = 150;
  for (const std::uint32_t edges : {20u, 600u}) {
    const SparseFactor factor(kSize, random_system(kSize, edges, 9));
    RandomStream random(3);
    PaddedVectors all(kSize);
    for (auto& row : all) row = PaddedVector(random.normal(), random.normal(), random.normal(), 0);
    PaddedVectors alone = all, first = all, second = all;
    for (auto& row : second) row *= 2;
    factor.solve(all.data());
    factor.solve_points(alone.data());
    factor.solve_points(first.data(), second.data());
    for (std::uint32_t i = 0; i < kSize; ++i) {
      EXPECT_LT((alone[i] - all[i]).norm(), kResidual * all[i].norm());
      EXPECT_LT((first[i] - all[i]).norm(), kResidual * all[i].norm());
      EXPECT_LT((second[i] - 2 * all[i]).norm(), kResidual * all[i].norm());
      EXPECT_EQ(first[i].w(), 0);
    }
  }
}

TEST(SparseFactor, OrderIsAPermutation) {
  const SparseFactor factor(60, random_system(60, 120, 5));
  std::vector<int> seen(60, 0);
  for (const std::uint32_t p : factor.position()) ++seen.at(p);
  for (const int count : seen) EXPECT_EQ(count, 1);
}

TEST(SparseFactor, AGivenOrderStands) {
  const SparseFactor factor(60, random_system(60, 120, 5), UnknownOrder::given);
  for (std::uint32_t i = 0; i < 60; ++i) EXPECT_EQ(factor.position()[i], i);
}

TEST(SparseFactor, EmptySystemIsFine) {
  const SparseFactor factor(0, {});
  EXPECT_EQ(factor.size(), 0u);
  factor.solve(nullptr);
}

TEST(SparseFactor, RefusesWhatIsNotPositiveDefinite) {
  EXPECT_THROW(SparseFactor(2, {{0, 0, 1}, {1, 1, -1}}), BadDataError);
  EXPECT_THROW(SparseFactor(2, {{0, 0, 1}, {1, 1, 1}, {0, 1, -2}}), BadDataError);
  EXPECT_THROW(SparseFactor(1, {{0, 0, std::nan("")}}), BadDataError);
}

constexpr double kPi = std::numbers::pi;
constexpr double kPolynomial = 2e-11;  // of the angle: what angles_of promises
constexpr double kRounding = 1e-11;    // a small angle's sine has lost digits

PaddedVector at_angle(double radians) { return {std::cos(radians), std::sin(radians), 0, 0}; }

TEST(AnglesOf, AreTheArctangents) {
  RandomStream random(1);
  for (int i = 0; i < 10000; ++i) {
    Double4 sine, cosine;
    for (int lane = 0; lane < 4; ++lane) {
      const double size = std::pow(10, random.uniform(-12, 12)), at = random.uniform(0, kPi);
      sine[lane] = size * std::sin(at), cosine[lane] = size * std::cos(at);
    }
    const Double4 angles = angles_of(sine, cosine);
    for (int lane = 0; lane < 4; ++lane) {
      const double exact = std::atan2(sine[lane], cosine[lane]);
      EXPECT_NEAR(angles[lane], exact, kPolynomial * exact);
    }
  }
}

TEST(AnglesOf, AtTheEndsAndInTheMiddle) {
  const Double4 angles = angles_of(Double4{0, 0, 2, 1e-140}, Double4{3, -3, 0, 1e-140});
  const double exact[] = {0, kPi, kPi / 2, kPi / 4};
  for (int lane = 0; lane < 4; ++lane) EXPECT_NEAR(angles[lane], exact[lane], 4 * kPolynomial);
}

TEST(Angle, AddsUpToHalfATurn) {
  RandomStream random(2);
  for (int i = 0; i < 1000; ++i) {
    const double a = random.uniform(0, kPi), b = random.uniform(0, kPi);
    const Angle first = Angle::between(at_angle(0.3), at_angle(0.3 + a));
    const Angle second = Angle::between(at_angle(-b), at_angle(0));
    const Angle sum = first + second;
    EXPECT_NEAR(sum.cosine, std::cos(std::min(a + b, kPi)), kRounding);
    EXPECT_NEAR(wider(first, second).cosine, std::cos(std::max(a, b)), kRounding);
    EXPECT_EQ(sum.acute(), a + b < kPi / 2);
  }
  EXPECT_EQ((kHalfTurn + kNoAngle).cosine, -1);
  EXPECT_EQ((kHalfTurn + kHalfTurn).cosine, -1);
  EXPECT_FALSE((kHalfTurn + Angle::between(at_angle(0), at_angle(1))).acute());
}

}  // namespace
}  // namespace organbake::deform
