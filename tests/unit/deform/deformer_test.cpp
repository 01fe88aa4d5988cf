// SPDX-License-Identifier: Apache-2.0

#include "organbake/deform/deformer.h"
#include "organbake/core/error.h"
#include "support/error_message.h"
#include "support/testing.h"
#include "unit/deform/test_bodies.h"

namespace organbake {
namespace {

using ::testing::HasSubstr;

TEST(DeformOptions, DefaultsAreValid) { EXPECT_NO_THROW(DeformOptions{}.check()); }

TEST(DeformOptions, EachBoundIsChecked) {
  const auto refuses = [](const std::function<void(DeformOptions&)>& spoil) {
    DeformOptions options;
    spoil(options);
    EXPECT_THROW(options.check(), UsageError);
  };
  refuses([](DeformOptions& o) { o.time_step_s = 0; });
  refuses([](DeformOptions& o) { o.time_step_s = 2; });
  refuses([](DeformOptions& o) { o.time_step_s = std::nan(""); });
  refuses([](DeformOptions& o) { o.iterations = 0; });
  refuses([](DeformOptions& o) { o.iterations = 1001; });
  refuses([](DeformOptions& o) { o.friction = -0.1; });
  refuses([](DeformOptions& o) { o.friction = std::nan(""); });
  refuses([](DeformOptions& o) { o.stiffness = 0; });
  refuses([](DeformOptions& o) { o.stiffness = std::nan(""); });
}

TEST(Deformer, RefusesTipsThatMakeNoSense) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  Deformer deformer(mesh, test::spring_body(mesh), {});
  Instrument good;
  good.active = true;
  good.position_mm = {0, 0, 44};
  deformer.step({good});
  const auto before = deformer.positions();

  const auto refuses_tip = [&](const std::function<void(Instrument&)>& spoil) {
    Instrument bad = good;
    spoil(bad);
    EXPECT_THAT(message_of(ExitCode::usage,
                           [&] {
                             deformer.step({good, bad});
                           }),
                testing::HasSubstr("tip 1"));
    EXPECT_TRUE(deformer.positions() == before) << "a refused step changes nothing";
  };
  refuses_tip([](Instrument& t) { t.position_mm.y() = std::nan(""); });
  refuses_tip([](Instrument& t) { t.position_mm.y() = INFINITY; });
  refuses_tip([](Instrument& t) { t.position_mm.y() = 1e200; });
  refuses_tip([](Instrument& t) { t.radius_mm = 0; });
  refuses_tip([](Instrument& t) { t.radius_mm = 0.01; });
  refuses_tip([](Instrument& t) { t.radius_mm = std::nan(""); });
  refuses_tip([](Instrument& t) { t.axis_mm.x() = std::nan(""); });
  refuses_tip([](Instrument& t) { t.axis_mm.y() = 1e300; });
  refuses_tip([](Instrument& t) { t.kind = Needle{}; });  // without a length

  EXPECT_THROW(deformer.step(std::vector<Instrument>(kMostInstruments + 1, good)), UsageError);
  EXPECT_TRUE(deformer.positions() == before);

  Instrument idle;
  idle.position_mm.x() = std::nan("");
  EXPECT_NO_THROW(deformer.step({good, idle})) << "an inactive tip may hold anything";
}

using PointList = std::vector<Eigen::Vector3d>;

// kg·mm/s.
Eigen::Vector3d momentum(const MechanicsModel& model, const PointList& before,
                         const PointList& after, double dt) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t v = 0; v < after.size(); ++v) {
    sum += model.mass_kg[v] / dt * (after[v] - before[v]);
  }
  return sum;
}

// Kinetic and spring energy, kg·mm²/s² (µJ).
double energy(const MechanicsModel& model, const PointList& before, const PointList& after,
              double dt) {
  double sum = 0;
  for (std::size_t v = 0; v < after.size(); ++v) {
    sum += 0.5 * model.mass_kg[v] * (after[v] - before[v]).squaredNorm() / (dt * dt);
  }
  for (const Spring& s : model.springs) {
    const double stretch = (after[s.a] - after[s.b]).norm() - s.rest_length_mm;
    sum += 0.5 * 1000 * s.stiffness_n_per_mm * stretch * stretch;
  }
  return sum;
}

// A tetrahedron whose base is held and whose apex hangs on three equal springs.
struct Tripod {
  TriangleMesh mesh;
  MechanicsModel mechanics;
  Tripod(double stiffness_n_per_mm, double mass_kg) {
    const double s = std::sqrt(3.0) / 2;
    mesh.vertices = {{20, 0, 0}, {-10, 20 * s, 0}, {-10, -20 * s, 0}, {0, 0, 20}};
    mesh.faces = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    mechanics.mass_kg.assign(4, mass_kg);
    mechanics.anchors = {0, 1, 2};
    mechanics.volume_stiffness = 0;
    for (std::uint32_t v = 0; v < 3; ++v) {
      mechanics.springs.push_back(
          {v, 3, (mesh.vertices[3] - mesh.vertices[v]).norm(), stiffness_n_per_mm, 0});
    }
  }
};

// Newtons, millimetres, and the sign: the tissue pulls a grasper back by the sum of its springs.
TEST(DeformerUnits, HeldForceIsTheSpringsForce) {
  constexpr double kForceRelative = 1e-3;  // the solver gives each constraint 1e-4 of its motion
  const Tripod tripod(0.5, 0.01);
  Deformer deformer(tripod.mesh, tripod.mechanics, {});
  StepReport report = deformer.step({test::grasper_at({0, 0, 20}, 3)});
  for (int step = 0; step < 200; ++step) report = deformer.step({test::grasper_at({0, 0, 24}, 3)});
  Eigen::Vector3d expected_n = Eigen::Vector3d::Zero();
  for (const Spring& s : tripod.mechanics.springs) {
    const Eigen::Vector3d along = tripod.mesh.vertices[s.a] - deformer.positions()[3];
    expected_n += s.stiffness_n_per_mm * (along.norm() - s.rest_length_mm) * along.normalized();
  }
  EXPECT_NEAR(deformer.positions()[3].z(), 24, 0.01);
  ASSERT_LT(expected_n.z(), -1) << "the springs pull down";
  EXPECT_NEAR(report.tip_force_n.at(0).z(), expected_n.z(),
              kForceRelative * std::abs(expected_n.z()));
  EXPECT_NEAR(report.tip_force_n[0].head<2>().norm(), 0, kForceRelative * expected_n.norm());
}

// Masses are kilograms and N/mm is 1000 kg/s²: the apex swings with ω = √(3 k cos² / m).
TEST(DeformerUnits, SwingsAtItsNaturalFrequency) {
  constexpr double kPeriodRelative = 0.02;  // 200 steps a period, first order in time
  constexpr double kMass_kg = 0.01, kStiffness = 0.5;
  const Tripod tripod(kStiffness, kMass_kg);
  const double omega = std::sqrt(3 * 1000 * kStiffness * 0.5 / kMass_kg);  // springs lean 45°
  const double period_s = 2 * std::numbers::pi / omega;
  DeformOptions options;
  options.time_step_s = period_s / 200;
  Deformer deformer(tripod.mesh, tripod.mechanics, {}, options);
  deformer.step({test::grasper_at({0, 0, 20}, 3)});
  for (int step = 0; step < 50; ++step) deformer.step({test::grasper_at({0, 0, 20.1}, 3)});
  // Let go: a quarter of a period later the apex passes its rest height.
  int steps = 0;
  while (deformer.positions()[3].z() > 20 && steps < 1000) deformer.step({}), ++steps;
  EXPECT_NEAR(steps, 50, 1 + 50 * kPeriodRelative);
}

TEST(Deformer, AFreeBodyKeepsItsMomentum) {
  constexpr double kRelative = 1e-9;  // rounding over some hundred additions a step
  const TriangleMesh mesh = test::lumpy_organ(2, 40, 4);
  test::BodyOptions body;
  body.anchored_below = -2;  // none
  const MechanicsModel mechanics = test::spring_body(mesh, body);
  DeformOptions options;
  Deformer deformer(mesh, mechanics, {}, options);
  deformer.step({test::grasper_at(mesh.vertices[0], 6)});
  for (int step = 1; step <= 20; ++step) {
    const Eigen::Vector3d pull(0.5 * step, 0.3 * step, -0.1 * step);
    deformer.step({test::grasper_at(mesh.vertices[0] + pull, 6)});
  }
  PointList before = deformer.positions();
  deformer.step({});
  const Eigen::Vector3d first =
      momentum(mechanics, before, deformer.positions(), options.time_step_s);
  ASSERT_GT(first.norm(), 1e-3);
  for (int step = 0; step < 100; ++step) {
    before = deformer.positions();
    deformer.step({});
    const Eigen::Vector3d now =
        momentum(mechanics, before, deformer.positions(), options.time_step_s);
    EXPECT_LT((now - first).norm(), kRelative * first.norm()) << "step " << step;
  }
}

TEST(Deformer, EnergyNeverGrowsWithoutInput) {
  constexpr double kRelative = 1e-6;  // of the energy at release: unconverged rounding of volumes
  for (const double stiffness : {0.1, 10.0, 1000.0}) {
    for (const double damping : {0.0, 0.7}) {
      const TriangleMesh mesh = test::geodesic_sphere(2, 40);
      test::BodyOptions body;
      body.stiffness_n_per_mm = stiffness;
      body.damping_ratio = damping;
      const MechanicsModel mechanics = test::spring_body(mesh, body);
      DeformOptions options;
      Deformer deformer(mesh, mechanics, {}, options);
      for (int step = 0; step < 40; ++step) {
        deformer.step({test::tool_at({5, 2, 46 - 0.4 * step})});
      }
      PointList before = deformer.positions();
      deformer.step({});
      double last = energy(mechanics, before, deformer.positions(), options.time_step_s);
      const double released = last;
      for (int step = 0; step < 300; ++step) {
        before = deformer.positions();
        deformer.step({});
        const double now = energy(mechanics, before, deformer.positions(), options.time_step_s);
        EXPECT_LE(now, last + kRelative * released)
            << "stiffness " << stiffness << ", damping " << damping << ", step " << step;
        last = now;
      }
    }
  }
}

// The held shape must not depend on how few iterations a step takes.
TEST(Deformer, HeldShapeConverges) {
  constexpr double kOfDepth = 0.02;
  constexpr double kDepth_mm = 14;
  for (const int frequency : {2, 4}) {
    const TriangleMesh mesh = test::geodesic_sphere(frequency, 40);
    const MechanicsModel mechanics = test::spring_body(mesh);
    const auto held = [&](int iterations, double time_step_s) {
      DeformOptions options;
      options.iterations = iterations;
      options.time_step_s = time_step_s;
      options.friction = 0;  // with friction the shape depends on the way there
      Deformer deformer(mesh, mechanics, test::sphere_base(mesh, 40, 4), options);
      for (int step = 0; step < 90; ++step)
        deformer.step({test::tool_at({0, 1, 45 - kDepth_mm * std::min(1.0, step / 30.0)})});
      return deformer.positions();
    };
    const PointList reference = held(300, 1.0 / 60);
    for (const double rate : {30.0, 60.0, 120.0}) {
      const PointList shape = held(4, 1 / rate);
      EXPECT_LT(test::farthest_between(shape, reference), kOfDepth * kDepth_mm)
          << "frequency " << frequency << ", rate " << rate;
    }
  }
}

}  // namespace
}  // namespace organbake
