// SPDX-License-Identifier: Apache-2.0

#include "contact/contact_search.h"
#include "organbake/core/error.h"
#include "organbake/core/random.h"
#include "organbake/deform/deformer.h"
#include "organbake/geometry/refine.h"
#include "support/testing.h"
#include "unit/deform/test_bodies.h"

namespace organbake::deform {
namespace {

using Eigen::Vector3d;

constexpr double kOnCapsule_mm = 0.1;  // what a contact must hold to
constexpr double kRadius_mm = 4;

Instrument capsule(const Vector3d& at, const Vector3d& axis, double radius_mm = 3) {
  return {at, radius_mm, Ball{}, true, axis};
}

Instrument rod(const Vector3d& from_mm, const Vector3d& axis_mm) {
  return capsule(from_mm, axis_mm, kRadius_mm);
}

double distance_to_axis(const Instrument& tip, const Vector3d& point) {
  const double t = (point - tip.position_mm).dot(tip.axis_mm) / tip.axis_mm.squaredNorm();
  return (tip.position_mm + std::clamp(t, 0.0, 1.0) * tip.axis_mm - point).norm();
}

// Over a fine grid of points of every face: without a base layer the proxy is the skin.
double skin_to_axis(const TriangleMesh& mesh, const Deformer& deformer, const Instrument& tip) {
  constexpr int kSteps = 12;
  const auto& at = deformer.positions();
  double nearest = std::numeric_limits<double>::infinity();
  for (const Face& f : mesh.faces) {
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; i + j <= kSteps; ++j) {
        const double u = double(i) / kSteps, v = double(j) / kSteps;
        const Vector3d p = (1 - u - v) * at[f[0]] + u * at[f[1]] + v * at[f[2]];
        nearest = std::min(nearest, distance_to_axis(tip, p));
      }
    }
  }
  return nearest;
}

TEST(Capsule, TheSkinLiesAlongItsWholeLength) {
  const TriangleMesh mesh = test::geodesic_sphere(7, 40);
  Deformer deformer(mesh, test::spring_body(mesh), {});
  StepReport report;
  Instrument tip;
  for (int step = 0; step <= 90; ++step) {
    const double height_mm = 46 - 12 * std::min(1.0, step / 60.0);
    tip = rod({-15, 1, height_mm}, {30, 0, 0});
    report = deformer.step({tip});
  }
  EXPECT_GT(skin_to_axis(mesh, deformer, tip), kRadius_mm - kOnCapsule_mm);
  EXPECT_LT(skin_to_axis(mesh, deformer, tip), kRadius_mm + kOnCapsule_mm);
  EXPECT_GT(report.contacts, 3u);
  EXPECT_GT(report.tip_force_n[0].z(), 0) << "the tissue pushes the tip out";
  // A ball at the middle alone would leave the skin under the ends where the sphere was.
  const auto highest_near = [&](double x_mm) {
    double z = 0;
    for (const Vector3d& p : deformer.positions())
      if (std::abs(p.x() - x_mm) < 4 && std::abs(p.y()) < 4) z = std::max(z, p.z());
    return z;
  };
  const double axis_mm = tip.position_mm.z();
  for (const double x_mm : {-10.0, 0.0, 10.0}) EXPECT_LT(highest_near(x_mm), axis_mm) << x_mm;
}

TEST(Capsule, EitherEndMayBeItsPosition) {
  constexpr double kSame_mm = 0.1;  // the deepest points are sought from the same starts
  const TriangleMesh mesh = test::geodesic_sphere(4, 40);
  Deformer one(mesh, test::spring_body(mesh), {}), other(mesh, test::spring_body(mesh), {});
  for (int step = 0; step <= 60; ++step) {
    const double height_mm = 46 - 8 * step / 60.0;
    one.step({rod({-10, 2, height_mm}, {20, 0, 0})});
    other.step({rod({10, 2, height_mm}, {-20, 0, 0})});
  }
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    EXPECT_LT((one.positions()[v] - other.positions()[v]).norm(), kSame_mm);
}

TEST(Capsule, AFastOneDoesNotTunnel) {
  for (const double deep_mm : {25.0, 10.0}) {
    const TriangleMesh mesh = test::geodesic_sphere(4, 40);
    Deformer deformer(mesh, test::spring_body(mesh), {});
    deformer.step({rod({-12, 1, 70}, {24, 0, 0})});
    const Instrument tip = rod({-12, 1, deep_mm}, {24, 0, 0});  // in one step of 1/60 s
    for (int step = 0; step < 30; ++step) deformer.step({tip});
    // After the blow the skin is folded round the capsule: each face is held at its deepest points
    // alone, up to the tip's most contacts. Rounding decides how it folds: forty starts that differ
    // by 1e-9 mm fold in four ways, 0.03 to 0.31 mm into the capsule.
    constexpr double kFolded_mm = 0.35;
    EXPECT_GT(skin_to_axis(mesh, deformer, tip), kRadius_mm - kFolded_mm) << deep_mm;
    for (const Vector3d& p : deformer.positions()) {
      if (std::abs(p.x()) < 8 && std::abs(p.y() - 1) < 2) {
        EXPECT_LT(p.z(), deep_mm) << "skin was left above";
      }
    }
  }
}

// The far end swings through half a turn's chord while the position hardly moves.
TEST(Capsule, AFastSwingDoesNotTunnel) {
  const TriangleMesh mesh = test::geodesic_sphere(4, 40);
  Deformer deformer(mesh, test::spring_body(mesh), {});
  deformer.step({rod({-70, 0, 30}, {50, 0, 50})});
  const Instrument tip = rod({-70, 0, 30}, {75, 0, 0});
  for (int step = 0; step < 10; ++step) deformer.step({tip});
  EXPECT_GT(skin_to_axis(mesh, deformer, tip), kRadius_mm - kOnCapsule_mm);
  EXPECT_LT(deformer.positions()[0].norm(), 100) << "pushed, not thrown";
}

constexpr double kTouching_mm = 1e-6;

Instrument ball(const Vector3d& at, double radius_mm = 5) {
  return test::tool_at(at, Ball{}, radius_mm);
}

double gap_mm(const Instrument& a, const Instrument& b) {
  const auto [s, t] = nearest_on_segments(a.position_mm, a.axis_mm, b.position_mm, b.axis_mm);
  return (a.position_mm + s * a.axis_mm - b.position_mm - t * b.axis_mm).norm() - a.radius_mm -
         b.radius_mm;
}

TEST(ToolContacts, NearestPointsBeatEverySample) {
  RandomStream random(3);
  const auto point = [&] { return Vector3d(random.normal(), random.normal(), random.normal()); };
  for (int trial = 0; trial < 200; ++trial) {
    const Vector3d p = point(), q = point();
    // Points and parallels among them.
    const Vector3d u = trial % 5 == 0 ? Vector3d::Zero().eval() : point();
    const Vector3d v = trial % 7 == 0 ? Vector3d::Zero().eval() : trial % 3 == 0 ? u : point();
    const auto [s, t] = nearest_on_segments(p, u, q, v);
    ASSERT_TRUE(s >= 0 && s <= 1 && t >= 0 && t <= 1);
    const double found = (p + s * u - q - t * v).norm();
    for (int i = 0; i <= 20; ++i) {
      for (int j = 0; j <= 20; ++j) {
        EXPECT_LE(found, (p + i / 20. * u - q - j / 20. * v).norm() + kTouching_mm);
      }
    }
  }
}

TEST(ToolContacts, ToolsThatOverlapPartByHalfEach) {
  const auto held = held_apart({ball({0, 0, 0}), ball({6, 0, 0})});
  EXPECT_NEAR(gap_mm(held[0], held[1]), 0, kTouching_mm);
  EXPECT_NEAR(held[0].position_mm.x(), -2, kTouching_mm);
  EXPECT_NEAR(held[1].position_mm.x(), 8, kTouching_mm);
}

TEST(ToolContacts, ToolsApartAndToolsAwayAreLeftAlone) {
  Instrument away = ball({0, 0, 0});
  away.active = false;
  const std::vector<Instrument> tips = {ball({0, 0, 0}), ball({11, 0, 0}), away};
  const auto held = held_apart(tips);
  for (std::size_t i = 0; i < tips.size(); ++i) EXPECT_EQ(held[i].position_mm, tips[i].position_mm);
}

TEST(ToolContacts, BladesCrossNeitherEachOtherNorABall) {
  const auto held = held_apart(
      {capsule({-10, 0, 0}, {20, 0, 0}), capsule({0, -10, 1}, {0, 20, 0}), ball({9, 1, 0}, 4)});
  for (std::size_t i = 0; i < held.size(); ++i) {
    for (std::size_t j = i + 1; j < held.size(); ++j)
      EXPECT_GT(gap_mm(held[i], held[j]), -kTouching_mm);
  }
  EXPECT_GT(held[1].position_mm.z(), held[0].position_mm.z());  // the way they came
}

TEST(ToolContacts, CoincidentToolsStillPart) {
  for (const auto& tips :
       {std::vector{ball({1, 2, 3}), ball({1, 2, 3})},
        std::vector{capsule({0, 0, 0}, {9, 0, 0}), capsule({0, 0, 0}, {9, 0, 0})},
        std::vector{capsule({-5, 0, 0}, {9, 0, 0}), capsule({0, -5, 0}, {0, 9, 0})}}) {
    const auto held = held_apart(tips);
    EXPECT_TRUE(held[0].position_mm.allFinite() && held[1].position_mm.allFinite());
    EXPECT_GT(gap_mm(held[0], held[1]), -kTouching_mm);
  }
}

TEST(ToolContacts, AFastToolDoesNotPassThroughAnother) {
  const std::vector<Instrument> held = {ball({0, 0, 0}, 6), ball({60, 0, 0}, 3)};
  for (const double y : {0.0, 2.0, 8.5}) {
    const auto moved = moved_apart(held, {ball({0, 0, 0}, 6), ball({-40, y, 0}, 3)});
    EXPECT_GT(gap_mm(moved[0], moved[1]), -kTouching_mm) << y;
  }
  const auto stopped = moved_apart(held, {ball({0, 0, 0}, 6), ball({-40, 0, 0}, 3)});
  EXPECT_GT(stopped[1].position_mm.x(), stopped[0].position_mm.x());
  // Blades that would swing through each other.
  const std::vector<Instrument> blades = {capsule({-20, 0, 0}, {40, 0, 0}, 1),
                                          capsule({0, -20, 30}, {0, 40, 0}, 1)};
  auto through = blades;
  through[1].position_mm.z() = -30;
  const auto crossed = moved_apart(blades, through);
  EXPECT_GT(crossed[1].position_mm.z(), crossed[0].position_mm.z());
}

TEST(ToolContacts, AToolThatKeepsBeingPushedStaysOnItsSide) {
  std::vector<Instrument> held = {ball({0, 0, 0}), ball({20, 0, 0})};
  for (int step = 0; step <= 200; ++step) {
    held = moved_apart(held, {ball({0, 0, 0}), ball({20 - 0.2 * step, 0, 0})});
    ASSERT_GT(held[1].position_mm.x(), held[0].position_mm.x()) << step;
    ASSERT_GT(gap_mm(held[0], held[1]), -kTouching_mm) << step;
  }
  EXPECT_EQ(count_touching(held), 1u);
  // Taken back, both are where they are asked for.
  for (int step = 200; step >= 0; --step)
    held = moved_apart(held, {ball({0, 0, 0}), ball({20 - 0.2 * step, 0, 0})});
  EXPECT_EQ(held[0].position_mm, Vector3d(0, 0, 0));
  EXPECT_EQ(held[1].position_mm, Vector3d(20, 0, 0));
  EXPECT_EQ(count_touching(held), 0u);
}

TEST(ToolContacts, ToolsThatMeetNoneEndWhereTheyAreAskedFor) {
  const std::vector<Instrument> asked = {ball({1.1, 2.3, 4.7}), ball({100.3, 0.1, 0})};
  const auto moved = moved_apart({ball({0, 0, 0}), ball({90, 0, 0})}, asked);
  for (std::size_t i = 0; i < asked.size(); ++i)
    EXPECT_EQ(moved[i].position_mm, asked[i].position_mm);
  EXPECT_TRUE(moved_apart({}, {}).empty());
  EXPECT_EQ(moved_apart({}, asked).size(), 2u);
}

// Driven into each other on the skin: the report tells where they stopped, both press on.
TEST(ToolContacts, TheDeformerHoldsThemApart) {
  const TriangleMesh mesh = test::geodesic_sphere(4, 40);
  Deformer deformer(mesh, test::spring_body(mesh), {});
  StepReport report;
  for (int step = 0; step <= 40; ++step) {
    const double x = 12 - 0.25 * step;
    report = deformer.step({ball({-x, 0, 41}), ball({x, 0, 41})});
  }
  EXPECT_NEAR((report.tip_position_mm[0] - report.tip_position_mm[1]).norm(), 10, kTouching_mm);
  EXPECT_GT(report.tip_force_n[0].norm(), 0);
  EXPECT_GT(report.tip_force_n[1].norm(), 0);
  EXPECT_LT(report.penetration_mm, 0.1);
}

// Every one of them holds off every other: looked at a few million times, not some billions.
TEST(ToolContacts, AsManyAsThereMayBeFlyThroughOneAnotherAtOnce) {
  std::vector<Instrument> held, asked;
  for (std::size_t i = 0; i < kMostInstruments; ++i) {
    const double side_mm = i % 2 == 0 ? 900 : -900;
    held.push_back(ball({side_mm, static_cast<double>(i), 0}));
    asked.push_back(ball({-side_mm, static_cast<double>(i), 0}));
  }
  for (const Instrument& tip : moved_apart(held, asked)) ASSERT_TRUE(tip.position_mm.allFinite());
}

// A ball of tissue whose lower half is anchored, and a probe from below.
class AnchoredBall : public testing::TestWithParam<TissueSolver> {
 protected:
  static constexpr double kRadius_mm = 5, kModulus_kpa = 10;
  static constexpr double kAtWall_mm =
      1e-3;  // of a probe that is stopped: rounds of pushing it off

  Deformer deformer() const {
    test::FemOptions options;
    options.young_modulus_kpa = kModulus_kpa;
    options.anchored_below = 0.1;
    MechanicsModel mechanics = test::fem_ball(mesh, options);
    const MechanicsModel springs = test::spring_body(mesh, {.anchored_below = 0.1});
    mechanics.mass_kg = springs.mass_kg, mechanics.springs = springs.springs;
    mechanics.anchors = springs.anchors;
    DeformOptions deform;
    deform.solver = GetParam();
    return Deformer(mesh, mechanics, {}, deform);
  }
  // From the probe's middle to the mesh at rest.
  double distance_mm(const Vector3d& at) const {
    double nearest = 1e300;
    for (const auto& [i, j, k] : mesh.faces) {
      const Vector3d &a = mesh.vertices[i], &b = mesh.vertices[j], &c = mesh.vertices[k];
      const Vector3d w = nearest_on_triangle(at, a, b, c);
      nearest = std::min(nearest, (w[0] * a + w[1] * b + w[2] * c - at).norm());
    }
    return nearest;
  }

  const TriangleMesh mesh = test::geodesic_sphere(4, 40);
};

// It stops where it touches, and is pushed back by what Hertz (1882) says of a half space.
TEST_P(AnchoredBall, StopsAProbeAndPushesItBack) {
  Deformer tissue = deformer();
  StepReport report;
  double before_n = 0;
  for (int step = 0; step <= 20; ++step) {
    const Vector3d asked(2, 3, -50 + 0.7 * step);
    report = tissue.step({ball(asked, kRadius_mm)});
    const Vector3d held = report.tip_position_mm[0];
    EXPECT_GE(distance_mm(held), kRadius_mm - kAtWall_mm);
    EXPECT_GE(report.tip_force_n[0].norm(), before_n);
    before_n = report.tip_force_n[0].norm();
    if (report.contacts == 0) continue;
    ASSERT_EQ(report.contact_points.size(), report.contacts);
    const ContactPoint& wall = report.contact_points[0];
    EXPECT_NEAR((held - wall.position_mm).norm(), kRadius_mm, kAtWall_mm);
    const double pressed_mm = (held - asked).dot(wall.normal);
    const double modulus_mpa = 1e-3 * kModulus_kpa / (1 - 0.45 * 0.45);
    const double force_n = 4. / 3 * modulus_mpa * std::sqrt(kRadius_mm) * std::pow(pressed_mm, 1.5);
    EXPECT_LT((report.tip_force_n[0] - force_n * wall.normal).norm(), 1e-9 * force_n + 1e-12);
  }
  EXPECT_EQ(report.contacts, 1u);
  EXPECT_LT(report.tip_force_n[0].z(), -0.1);  // N: some 8 mm beyond
  Vector3d on_vertices = Vector3d::Zero();
  for (const Vector3d& force : tissue.contact_force_n()) on_vertices += force;
  EXPECT_LT((on_vertices + report.tip_force_n[0]).norm(), 1e-9);
  EXPECT_TRUE(tissue.positions() == mesh.vertices) << "what is anchored moves nowhere";

  report = tissue.step({ball({2, 3, -50}, kRadius_mm)});
  EXPECT_EQ(report.contacts, 0u);
  EXPECT_EQ(report.tip_force_n[0].norm(), 0);
}

// However fast it comes, and along the skin it slides on.
TEST_P(AnchoredBall, NeitherAFastProbeNorALongOnePassesIt) {
  Deformer tissue = deformer();
  for (const Vector3d& axis : {Vector3d(0, 0, 0), Vector3d(30, 0, -20)}) {
    tissue.step({capsule({0, 0, -60}, axis, kRadius_mm)});
    StepReport report = tissue.step({capsule({0, 0, 20}, axis, kRadius_mm)});
    EXPECT_LT(report.tip_position_mm[0].z(), -40);
    EXPECT_GT(report.contacts, 0u);
    report = tissue.step({capsule({-25, 0, -10}, axis, kRadius_mm)});
    const Vector3d held = report.tip_position_mm[0];
    EXPECT_LT(held.x(), -20) << "it goes on along the wall";
    EXPECT_GE(distance_mm(held), kRadius_mm - kAtWall_mm);
    tissue.step({});
  }
}

// What gives way is pushed in as ever, and other tools are let through.
TEST_P(AnchoredBall, OnlyWhatIsAnchoredStopsProbesAlone) {
  Deformer tissue = deformer();
  StepReport report;
  for (int step = 0; step <= 20; ++step)
    report = tissue.step({ball({0, 0, 50 - 0.7 * step}, kRadius_mm)});
  EXPECT_EQ(report.tip_position_mm[0].z(), 50 - 0.7 * 20);
  EXPECT_GT(report.contacts, 0u);
  tissue.reset();
  Instrument needle = capsule({0, 0, -60}, {0, 0, -60}, 0.6);
  needle.kind = Needle{};
  tissue.step({needle});
  needle.position_mm.z() = -30;
  EXPECT_EQ(tissue.step({needle}).tip_position_mm[0].z(), -30);
}

INSTANTIATE_TEST_SUITE_P(Solvers, AnchoredBall,
                         testing::Values(TissueSolver::springs, TissueSolver::fem));

}  // namespace
}  // namespace organbake::deform
