// SPDX-License-Identifier: Apache-2.0

#include "contact/padded_vector.h"
#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/deform/deformer.h"
#include "solver/sparse_factor.h"
#include "support/testing.h"
#include "unit/deform/test_bodies.h"

namespace organbake::deform {
namespace {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

using test::farthest_between, test::grasper_at, test::tool_at, test::with_fem;

// δ = F L / (E A): without sideways contraction the held end disturbs nothing.
TEST(FemDeformer, AHangingWeightStretchesTheBar) {
  constexpr double kRelative = 0.01;
  test::FemOptions tissue;
  tissue.poisson_ratio = 0;
  const test::FemBar bar(tissue);
  Deformer deformer(bar.mesh, bar.mechanics, {}, with_fem());
  constexpr double kForce_n = 0.2;  // of 4 N = E A: 5 %
  Points load;
  for (const double area : bar.end_areas()) load.push_back({kForce_n * area / (20 * 20), 0, 0});
  deformer.set_load(load);
  for (int step = 0; step < 300; ++step) deformer.step({});
  for (std::size_t v = 0; v < bar.mesh.vertices.size(); ++v) {
    const double along = bar.mesh.vertices[v].x();
    EXPECT_NEAR(deformer.positions()[v].x() - along, 0.05 * along, kRelative * 0.05 * 60);
    EXPECT_NEAR(deformer.positions()[v].y(), bar.mesh.vertices[v].y(), kRelative);
  }
  deformer.set_load({});
  for (int step = 0; step < 600; ++step) deformer.step({});
  EXPECT_TRUE(deformer.positions() == bar.mesh.vertices) << "back at rest, bit for bit";
}

// A vertex that is carried gives way by c per force beyond what its tissue does: held at the same
// depth, 1/F grows by c, and what a tip leaves comes back to rest to the last bit.
TEST(FemDeformer, SkinGivesWayBeyondItsTissue) {
  const TriangleMesh mesh = test::lumpy_organ(3, 40, 1);
  const auto top = static_cast<std::uint32_t>(
      std::max_element(mesh.vertices.begin(), mesh.vertices.end(),
                       [](const Vector3d& a, const Vector3d& b) { return a.z() < b.z(); }) -
      mesh.vertices.begin());
  constexpr double kGive_mm_per_n = 3, kPull_mm = 2;
  const auto force_n = [&](double give_mm_per_n) {
    MechanicsModel mechanics = test::fem_ball(mesh);
    mechanics.body->give_mm_per_n.assign(mesh.vertices.size(), give_mm_per_n);
    Deformer deformer(mesh, mechanics, {}, with_fem());
    Instrument tip = grasper_at(mesh.vertices[top], 0.05);  // it holds the vertex alone
    StepReport report;
    for (int step = 0; step <= 200; ++step) {
      tip.position_mm = mesh.vertices[top] + Vector3d(0, 0, std::min(kPull_mm, 0.05 * step));
      report = deformer.step({tip});
    }
    EXPECT_NEAR((deformer.positions()[top] - tip.position_mm).norm(), 0, 0.05);
    for (int step = 0; step < 900; ++step) deformer.step({});
    EXPECT_TRUE(deformer.positions() == mesh.vertices);
    return report.tip_force_n[0].norm();
  };
  const double without = force_n(0), with = force_n(kGive_mm_per_n);
  EXPECT_NEAR(kPull_mm / with, kPull_mm / without + kGive_mm_per_n, 0.1 * kGive_mm_per_n);
}

TEST(FemDeformer, ATipPushesIsPushedBackAndLetsGo) {
  const TriangleMesh mesh = test::geodesic_sphere(3, 40);
  Deformer deformer(mesh, test::fem_ball(mesh), test::sphere_base(mesh, 40, 8), with_fem());
  StepReport report;
  for (int step = 0; step < 120; ++step)
    report = deformer.step({tool_at({0, 1, 45 - std::min(15.0, 0.3 * step)})});
  EXPECT_GT(report.contacts, 0u);
  EXPECT_LT(report.penetration_mm, 0.1);
  EXPECT_GT(report.tip_force_n.at(0).z(), 0.1);
  EXPECT_NEAR(signed_volume(test::posed(mesh, deformer.positions())) / signed_volume(mesh), 1,
              0.05);
  for (int step = 0; step < 1200; ++step) deformer.step({});
  EXPECT_TRUE(deformer.positions() == mesh.vertices);
}

TEST(FemDeformer, AGrasperCarriesTheTissue) {
  const TriangleMesh mesh = test::geodesic_sphere(3, 40);
  Deformer deformer(mesh, test::fem_ball(mesh), {}, with_fem());
  deformer.step({grasper_at({0, 0, 42})});
  StepReport report;
  for (int step = 1; step <= 60; ++step)
    report = deformer.step({grasper_at({0, 0, 42 + 0.2 * step})});
  double highest = 0;
  for (const Vector3d& p : deformer.positions()) highest = std::max(highest, p.z());
  EXPECT_NEAR(highest, 52, 1);
  EXPECT_LT(report.tip_force_n.at(0).z(), -0.1) << "the tissue pulls back";
}

// The shape under a dead load must not depend on how few iterations a step takes.
TEST(FemDeformer, ALoadedShapeIsTheConvergedOne) {
  constexpr double kRelative = 0.01;
  const TriangleMesh mesh = test::lumpy_organ(2, 40, 5);
  const MechanicsModel mechanics = test::fem_ball(mesh);
  const auto loaded = [&](int iterations, int steps) {
    DeformOptions options = with_fem();
    options.iterations = iterations;
    Deformer deformer(mesh, mechanics, {}, options);
    Points load(mesh.vertices.size(), Vector3d::Zero());
    load[5] = {0.08, 0.02, 0.04};
    deformer.set_load(load);
    for (int step = 0; step < steps; ++step) deformer.step({});
    return deformer.positions();
  };
  const Points converged = loaded(100, 600);
  const double size = farthest_between(converged, mesh.vertices);
  ASSERT_GT(size, 1);
  EXPECT_LT(farthest_between(loaded(4, 120), converged), kRelative * size);
}

// 1e2…1e7 Pa at 240…15 steps a second, poked to half of the object and dragged: nothing is thrown
// about, lost or left inside out.
TEST(FemDeformer, StaysStable) {
  constexpr double kBounded_mm = 80;      // nothing may be thrown farther than the body is wide
  constexpr double kBackWithin_mm = 0.1;  // of rest after 30 s: jelly sways at 0.4 Hz
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  for (const double pascal : {1e2, 1e3, 1e4, 1e5, 1e6, 1e7}) {
    for (const double rate : {240.0, 60.0, 15.0}) {
      test::FemOptions tissue;
      tissue.young_modulus_kpa = pascal / 1000;
      tissue.damping_s = 1 / std::sqrt(pascal);  // as the baker gives it: 10 ms for liver
      Deformer deformer(mesh, test::fem_ball(mesh, tissue), {}, with_fem(1 / rate));
      double farthest = 0;
      int recoveries = 0;
      const auto poke = [&](const Vector3d& from, const Vector3d& to) {
        const int steps = static_cast<int>(0.4 * rate);
        for (int step = 0; step <= steps; ++step) {
          const double share = double(step) / steps;
          recoveries += deformer.step({tool_at(from + share * (to - from))}).recovered;
          farthest = std::max(farthest, farthest_between(deformer.positions(), mesh.vertices));
        }
        deformer.step({});
      };
      for (int round = 0; round < 5; ++round) {
        poke({0, 0, 50}, {0, 0, 5});
        poke({50, 5, 0}, {5, 5, 5});
        poke({30, 30, 30}, {-30, 10, 30});
      }
      const auto where = testing::Message() << pascal << " Pa at " << rate << " Hz";
      EXPECT_EQ(recoveries, 0) << where;
      EXPECT_LT(farthest, kBounded_mm) << where;
      for (int step = 0; step < 30 * rate; ++step) deformer.step({});
      EXPECT_LT(farthest_between(deformer.positions(), mesh.vertices), kBackWithin_mm) << where;
    }
  }
}

// What hangs on nothing loses its speed to the wet cavity; where the bundle does not say how fast,
// it coasts on as it did.
TEST(FemDeformer, WhatHangsOnNothingComesToRest) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 20);
  MechanicsModel mechanics = test::fem_ball(mesh);
  mechanics.body->anchors.clear();
  const auto moves_mm = [&](double drag_per_s) {
    mechanics.drag_per_s = drag_per_s;
    Deformer deformer(mesh, mechanics, {}, with_fem());
    for (int i = 0; i <= 10; ++i) deformer.step({tool_at({0, 0, 26.0 - i})});
    for (int i = 0; i < 60; ++i) deformer.step({});  // the dent swings back
    const auto middle = [&] {
      Vector3d sum = Vector3d::Zero();
      for (const Vector3d& v : deformer.positions()) sum += v;
      return Vector3d(sum / double(mesh.vertices.size()));
    };
    const Vector3d before = middle();
    deformer.step({});
    const double at_first = (middle() - before).norm();
    for (int i = 0; i < 60; ++i) deformer.step({});
    const Vector3d later = middle();
    deformer.step({});
    return std::pair(at_first, (middle() - later).norm());
  };
  const auto [coasts, coasts_on] = moves_mm(0);
  EXPECT_GT(coasts, 0.01);
  EXPECT_NEAR(coasts_on, coasts, 0.05 * coasts);
  constexpr double kDrag_per_s = 3;
  const auto [slows, slower] = moves_mm(kDrag_per_s);
  // A second of implicit steps of a sixtieth.
  EXPECT_NEAR(slower / slows, std::pow(1 + kDrag_per_s / 60, -61), 0.01);
}

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

TEST(SparseFactor, AGivenOrderStands) {
  const SparseFactor factor(60, random_system(60, 120, 5), UnknownOrder::given);
  for (std::uint32_t i = 0; i < 60; ++i) EXPECT_EQ(factor.position()[i], i);
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
