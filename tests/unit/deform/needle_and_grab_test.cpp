// SPDX-License-Identifier: Apache-2.0

#include "organbake/core/error.h"
#include "organbake/deform/deformer.h"
#include "organbake/geometry/shell.h"
#include "support/testing.h"
#include "unit/deform/test_bodies.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using test::grasper_at;

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

constexpr double kFollows_mm = 0.1;

struct Sphere {
  TriangleMesh mesh = test::geodesic_sphere(3, 40);
  MechanicsModel mechanics = test::spring_body(mesh);
  std::uint32_t top = 0;
  Sphere() {
    for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
      if (mesh.vertices[v].z() > mesh.vertices[top].z()) top = v;
    }
  }
};

TEST(Grab, CarriesWhatItClosedOn) {
  const Sphere s;
  Deformer deformer(s.mesh, s.mechanics, {});
  const Vector3d start = s.mesh.vertices[s.top];
  StepReport report = deformer.step({grasper_at(start)});
  EXPECT_LT((deformer.positions()[s.top] - start).norm(), kFollows_mm) << "closing pulls nothing";
  for (int step = 1; step <= 60; ++step) {
    const Vector3d drag(0.2 * step, 0.1 * step, 0.15 * step);
    report = deformer.step({grasper_at(start + drag)});
    EXPECT_LT((deformer.positions()[s.top] - start - drag).norm(), kFollows_mm) << step;
  }
  EXPECT_LT(report.tip_force_n.at(0).dot(Vector3d(2, 1, 1.5)), 0) << "the tissue pulls back";
  // It opens: the tissue goes home.
  for (int step = 0; step < 1200; ++step) deformer.step({});
  EXPECT_TRUE(deformer.positions() == s.mesh.vertices);
}

TEST(Grab, ReachesTheNearestSkinWithinTwoRadii) {
  const Sphere s;
  const Vector3d up = s.mesh.vertices[s.top].normalized();
  for (const double gap_mm : {6.0, 9.5, 11.0}) {
    Deformer deformer(s.mesh, s.mechanics, {});
    const Vector3d start = (40 + gap_mm) * up;
    deformer.step({grasper_at(start)});
    deformer.step({grasper_at(start + 5 * up)});
    const double lifted = (deformer.positions()[s.top] - s.mesh.vertices[s.top]).dot(up);
    // It keeps its distance from the tip; it does not jump to it.
    EXPECT_NEAR(lifted, gap_mm < 10 ? 5 : 0, kFollows_mm) << "gap " << gap_mm;
  }
}

// Closing pulls nothing: what the jaws fold is drawn where the grip is told to be.
TEST(Grab, TellsWhereItHoldsAndHowFarItHasClosed) {
  for (const TissueSolver solver : {TissueSolver::springs, TissueSolver::fem}) {
    HeldBall ball(solver);
    const Vector3d top = ball.mesh.vertices[ball.top], pull(2, 0, 3);
    double last = 0;
    for (int i = 0; i < 30; ++i) {
      EXPECT_EQ(ball.deformer.step({{}, grasper_at(top)}).slipped, 0u);
      ASSERT_EQ(ball.deformer.grips().size(), 1u);
      const Grip grip = ball.deformer.grips().front();
      EXPECT_EQ(grip.instrument, 1u);
      EXPECT_LT((grip.position_mm - top).norm(), kFollows_mm);
      EXPECT_GT(grip.outward.dot(top.normalized()), 0.99);
      EXPECT_GE(grip.closed, last + (i < 10 ? 1e-3 : 0));
      last = grip.closed;
    }
    EXPECT_NEAR(last, 1, 0.01);
    for (std::uint32_t v = 0; v < ball.mesh.vertices.size(); ++v)
      EXPECT_LT((ball.deformer.positions()[v] - ball.mesh.vertices[v]).norm(), kFollows_mm);
    for (int i = 1; i <= 30; ++i) ball.deformer.step({{}, grasper_at(top + i / 30.0 * pull)});
    EXPECT_LT((ball.deformer.grips().front().position_mm - top - pull).norm(), kFollows_mm);
    ball.deformer.step({});
    EXPECT_TRUE(ball.deformer.grips().empty());
  }
}

TEST(Grab, ClosesOnlyOnce) {
  const Sphere s;
  Deformer deformer(s.mesh, s.mechanics, {});
  // Closed in the air, then moved through the skin: it carries nothing and pushes nothing.
  for (int step = 0; step < 40; ++step) deformer.step({grasper_at({0, 0, 60.0 - step})});
  EXPECT_TRUE(deformer.positions() == s.mesh.vertices);
}

// On the true skin over a coarse face, where no proxy vertex is near.
TEST(Grab, HoldsSkinBetweenVertices) {
  const TriangleMesh mesh = test::geodesic_sphere(1, 40);
  const BaseLayer base = test::sphere_base(mesh, 40, 12);
  Deformer deformer(mesh, test::spring_body(mesh), base);
  std::uint32_t face = 0;
  const auto height = [&](std::uint32_t f) {
    return (mesh.vertices[mesh.faces[f][0]] + mesh.vertices[mesh.faces[f][1]] +
            mesh.vertices[mesh.faces[f][2]])
        .z();
  };
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) face = height(f) > height(face) ? f : face;
  const std::uint32_t middle = face * base.nodes_per_face() + base_node_index(12, 4, 4);
  const auto skin = [&](const std::vector<Vector3d>& vertices) {
    TriangleMesh now = mesh;
    now.vertices = vertices;
    return Vector3d(shell_point(shell_matrix(now, vertex_normals(now), face), 1.0 / 3, 1.0 / 3,
                                base.height_mm[middle]));
  };
  const Vector3d start = skin(mesh.vertices);
  deformer.step({grasper_at(start, 3)});
  for (int step = 1; step <= 30; ++step) {
    const Vector3d pull = 0.2 * step * start.normalized();
    deformer.step({grasper_at(start + pull, 3)});
    EXPECT_LT((skin(deformer.positions()) - start - pull).norm(), kFollows_mm) << step;
  }
}

TEST(Grab, APokeMayTurnIntoAGrab) {
  const Sphere s;
  Deformer deformer(s.mesh, s.mechanics, {});
  Instrument tip = grasper_at({0, 0, 46});
  tip.kind = Ball{};
  for (int step = 0; step < 40; ++step) {
    tip.position_mm.z() = 46 - 0.2 * step;
    deformer.step({tip});
  }
  const double pushed_z = tip.position_mm.z();
  tip.kind = Grasper{};
  StepReport report;
  for (int step = 0; step < 80; ++step) {
    tip.position_mm.z() = pushed_z + 0.2 * step;
    report = deformer.step({tip});
  }
  EXPECT_GT(deformer.positions()[s.top].z(), s.mesh.vertices[s.top].z() + 2);
  EXPECT_LT(report.tip_force_n.at(0).z(), 0);
}

}  // namespace
}  // namespace organbake
