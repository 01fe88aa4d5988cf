// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/deform/deformer.h"
#include "unit/deform/fem_bodies.h"
#include "unit/deform/test_bodies.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kOnNeedle_mm = 0.1;  // as near as contacts are held
constexpr double kBall_mm = 40;

// A needle along z, its point at the height given above the ball's top.
Instrument needle(double height_mm, double x_mm = 0) {
  Instrument tip;
  tip.position_mm = Vector3d(x_mm, 0, kBall_mm + height_mm);
  tip.axis_mm = Vector3d(0, 0, 80);
  tip.radius_mm = 0.6;
  tip.kind = Needle{};
  tip.active = true;
  return tip;
}

struct HeldBall {
  TriangleMesh mesh = test::geodesic_sphere(7, kBall_mm);
  std::uint32_t top = 0;  // the vertex that is nearest to the needle's line
  Deformer deformer;

  explicit HeldBall(TissueSolver solver) : deformer(made(mesh, solver)) {
    for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v)
      if (mesh.vertices[v].z() > mesh.vertices[top].z()) top = v;
  }
  static Deformer made(const TriangleMesh& mesh, TissueSolver solver) {
    DeformOptions options;
    options.solver = solver;
    return Deformer(mesh,
                    solver == TissueSolver::fem ? test::fem_ball(mesh) : test::spring_body(mesh),
                    {}, options);
  }
  // Steps of 0.25 mm from one height to another; of all, the punctures.
  std::size_t move(double from_mm, double to_mm, StepReport& report) {
    std::size_t punctures = 0;
    const int steps = static_cast<int>(std::abs(to_mm - from_mm) / 0.25);
    for (int i = 0; i <= steps; ++i) {
      report = deformer.step({needle(from_mm + (to_mm - from_mm) * i / steps)});
      EXPECT_FALSE(report.recovered);
      punctures += report.punctures.size();
    }
    return punctures;
  }
  double dent_mm() const { return kBall_mm - deformer.positions()[top].z(); }
};

class NeedleInTissue : public testing::TestWithParam<TissueSolver> {};

TEST_P(NeedleInTissue, GoesThroughOnceTheSkinIsPushedInFarEnough) {
  HeldBall ball(GetParam());
  StepReport report;
  EXPECT_EQ(ball.move(2, -3, report), 0u);
  EXPECT_GT(ball.dent_mm(), 1.5);
  EXPECT_GT(report.tip_force_n.at(0).z(), 0);
  EXPECT_EQ(ball.move(-3, -12, report), 1u);
  for (int i = 0; i < 60; ++i) report = ball.deformer.step({needle(-12)});
  // Let through, the skin goes back but for what friction holds: 20 mN a millimetre below it.
  EXPECT_LT(ball.dent_mm(), 3);
  EXPECT_LE(std::abs(report.tip_force_n.at(0).z()), 0.02 * 13);
}

TEST_P(NeedleInTissue, TakesTheSkinAlongSidewaysAndLetsItGo) {
  HeldBall ball(GetParam());
  StepReport report;
  ASSERT_EQ(ball.move(2, -12, report), 1u);
  const ContactPoint* on = nullptr;
  for (int i = 1; i <= 40; ++i) {
    report = ball.deformer.step({needle(-12, 0.2 * i)});
    ASSERT_EQ(report.contact_points.size(), 1u);
    on = &report.contact_points.front();
    EXPECT_NEAR(on->position_mm.x(), 0.2 * i, kOnNeedle_mm);
    EXPECT_NEAR(on->position_mm.y(), 0, kOnNeedle_mm);
  }
  EXPECT_LT(report.tip_force_n.at(0).x(), 0);  // it pulls back
  // Drawn out, the skin is free again and goes home.
  for (int i = 0; i <= 120; ++i) report = ball.deformer.step({needle(-12 + 0.25 * i, 8)});
  EXPECT_EQ(report.contacts, 0u);
  for (int i = 0; i < 1200; ++i) ball.deformer.step({needle(18, 8)});
  EXPECT_TRUE(ball.deformer.positions() == ball.mesh.vertices);
}

TEST_P(NeedleInTissue, PullsTheSkinOutByItsFrictionAlone) {
  HeldBall ball(GetParam());
  StepReport report;
  ASSERT_EQ(ball.move(2, -15, report), 1u);
  double outermost_mm = 0, strongest_n = 0;
  for (int i = 0; i <= 60; ++i) {
    report = ball.deformer.step({needle(-15 + 0.25 * i)});
    outermost_mm = std::max(outermost_mm, -ball.dent_mm());
    strongest_n = std::max(strongest_n, -report.tip_force_n.at(0).z());
  }
  EXPECT_GT(outermost_mm, 0.05);
  EXPECT_GT(strongest_n, 0.02);
  EXPECT_LT(strongest_n, 0.02 * 17);
}

TEST_P(NeedleInTissue, AnotherGoesInBesideIt) {
  HeldBall ball(GetParam());
  StepReport report;
  ASSERT_EQ(ball.move(2, -10, report), 1u);
  std::size_t punctures = 0;
  for (int i = 0; i <= 60; ++i) {
    report = ball.deformer.step({needle(-10), needle(2 - 0.25 * i, 9)});
    for (const ContactPoint& p : report.punctures) EXPECT_EQ(p.instrument, 1u);
    punctures += report.punctures.size();
  }
  EXPECT_EQ(punctures, 1u);
}

INSTANTIATE_TEST_SUITE_P(Solvers, NeedleInTissue,
                         testing::Values(TissueSolver::springs, TissueSolver::fem),
                         [](const auto& tissue) { return to_string(tissue.param); });

TEST(NeedleChecks, ItNeedsALength) {
  Instrument tip = needle(0);
  tip.axis_mm.setZero();
  EXPECT_THROW(check_instruments({tip}), UsageError);
}

}  // namespace
}  // namespace organbake
