// SPDX-License-Identifier: Apache-2.0

#include "organbake/core/random.h"
#include "organbake/deform/deformer.h"
#include "support/testing.h"
#include "unit/deform/test_bodies.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// Steps until nothing has moved for a while; returns the steps it took, or -1.
int steps_to_sleep(Deformer& deformer, const std::vector<Instrument>& tips, int limit) {
  for (int step = 0; step < limit; ++step) {
    deformer.step(tips);
    if (!deformer.moved()) return step;
  }
  return -1;
}

TEST(Deformer, RestStaysRestBitForBit) {
  const TriangleMesh mesh = test::lumpy_organ(3, 40, 1);
  Deformer deformer(mesh, test::spring_body(mesh), test::sphere_base(mesh, 42, 4));
  const std::vector<Instrument> away = {test::tool_at({0, 0, 80}), Instrument{}};
  for (int step = 0; step < 100; ++step) {
    const StepReport report = deformer.step(step % 2 ? away : std::vector<Instrument>{});
    EXPECT_FALSE(deformer.moved());
    EXPECT_EQ(report.contacts, 0u);
    EXPECT_FALSE(report.recovered);
  }
  EXPECT_TRUE(deformer.positions() == mesh.vertices);
}

// A tip that sweeps close by wakes the solver; the shape it then finds must still be rest itself.
TEST(Deformer, ANearMissLeavesRestBitForBit) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  Deformer springs(mesh, test::spring_body(mesh), {});
  Deformer elements(mesh, test::fem_ball(mesh), test::sphere_base(mesh, 40, 4), test::with_fem());
  for (Deformer* deformer : {&springs, &elements}) {
    for (int step = 0; step < 100; ++step) {
      deformer->step({test::tool_at({step * 0.1 - 5, 0, 45.5})});
      EXPECT_FALSE(deformer->moved());
    }
    EXPECT_TRUE(deformer->positions() == mesh.vertices);
  }
}

TEST(Deformer, ReleaseReturnsToRestExactlyAndSleeps) {
  for (const double stiffness : {0.1, 10.0, 1e4}) {
    const TriangleMesh mesh = test::geodesic_sphere(2, 40);
    test::BodyOptions body;
    body.stiffness_n_per_mm = stiffness;
    Deformer deformer(mesh, test::spring_body(mesh, body), test::sphere_base(mesh, 40, 6));
    for (int step = 0; step < 60; ++step) deformer.step({test::tool_at({4, 3, 46 - 0.35 * step})});
    ASSERT_FALSE(deformer.positions() == mesh.vertices);
    constexpr int kLimit = 1200;  // 20 s
    EXPECT_GE(steps_to_sleep(deformer, {}, kLimit), 1) << stiffness;
    EXPECT_TRUE(deformer.positions() == mesh.vertices);
  }
}

// Between two equal key frames a tip trembles by rounding, which is no reason to stay awake.
TEST(Deformer, SleepsUnderATipThatTremblesByRounding) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  Deformer deformer(mesh, test::spring_body(mesh), {});
  const Eigen::Vector3d deep(1.7, 0.3, 37.1);
  bool trembled = false, slept = false;
  for (int step = 0; step < 600 && !slept; ++step) {
    const double share = step / 601.0;
    const Eigen::Vector3d at = (1 - share) * deep + share * deep;
    trembled = trembled || at != deep;
    deformer.step({test::tool_at(at)});
    slept = !deformer.moved();
  }
  EXPECT_TRUE(trembled);
  EXPECT_TRUE(slept);
}

TEST(Deformer, SleepsUnderAStillTipAndWakesWithIt) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  Deformer deformer(mesh, test::spring_body(mesh), {});
  for (int step = 0; step < 30; ++step) deformer.step({test::tool_at({0, 0, 46 - 0.5 * step})});
  const std::vector<Instrument> held = {test::tool_at({0, 0, 31})};
  constexpr int kLimit = 600;  // 10 s
  ASSERT_GE(steps_to_sleep(deformer, held, kLimit), 1);
  const StepReport asleep = deformer.step(held);
  EXPECT_GT(asleep.contacts, 0u);
  EXPECT_GT(asleep.tip_force_n.at(0).z(), 0) << "the force is still reported";

  deformer.step({test::tool_at({0, 0, 30})});
  EXPECT_TRUE(deformer.moved());
  steps_to_sleep(deformer, {test::tool_at({0, 0, 30})}, kLimit);
  deformer.step({});
  EXPECT_TRUE(deformer.moved()) << "a tip that goes away wakes what it held";
}

// Springs that are not at their rest length at rest: the body sets off by itself, and may sleep
// only where it has come to stand.
TEST(Deformer, AStretchedBodyRelaxesElsewhere) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  MechanicsModel mechanics = test::spring_body(mesh);
  mechanics.volume_stiffness = 0;
  for (Spring& s : mechanics.springs) s.rest_length_mm *= 0.95;
  Deformer deformer(mesh, mechanics, {});
  deformer.step({});
  EXPECT_TRUE(deformer.moved());
  EXPECT_GE(steps_to_sleep(deformer, {}, 3000), 0);
  const TriangleMesh shrunk = test::posed(mesh, deformer.positions());
  EXPECT_LT(signed_volume(shrunk), 0.95 * signed_volume(mesh));
}

// The same script gives the same bits, also after a reset.
TEST(Deformer, RepeatsExactly) {
  const TriangleMesh mesh = test::lumpy_organ(3, 40, 6);
  for (const bool fem : {false, true}) {
    const MechanicsModel mechanics = fem ? test::fem_ball(mesh) : test::spring_body(mesh);
    const DeformOptions options = fem ? test::with_fem() : DeformOptions{};
    Deformer one(mesh, mechanics, {}, options), two(mesh, mechanics, {}, options);
    const auto play = [](Deformer& d) {
      for (int step = 0; step < 40; ++step)
        d.step({test::tool_at({0.2 * step, 0, 46 - 0.5 * step})});
      return d.positions();
    };
    const auto first = play(one);
    EXPECT_TRUE(first == play(two)) << fem;
    one.reset();
    EXPECT_TRUE(one.positions() == mesh.vertices) << fem;
    one.step({});
    EXPECT_FALSE(one.moved()) << fem;
    EXPECT_TRUE(first == play(one)) << fem;
  }
}

// A tip that pokes in and out at a hand's speeds from seeded sides, to half of the object.
class PokingTip {
 public:
  explicit PokingTip(std::uint64_t seed) : random_(seed) { aim(); }

  const Instrument& advance(double time_step_s) {
    tip_.active = true;
    distance_mm_ += (inwards_ ? -1 : 1) * speed_mm_per_s_ * time_step_s;
    if (distance_mm_ < kDeepest_mm) distance_mm_ = kDeepest_mm, inwards_ = false;
    tip_.position_mm = distance_mm_ * direction_;
    if (distance_mm_ > kAway_mm) aim();
    return tip_;
  }

 private:
  void aim() {
    direction_ = Vector3d(random_.normal(), random_.normal(), std::abs(random_.normal()));
    direction_.normalize();
    speed_mm_per_s_ = random_.uniform(30, 300);
    distance_mm_ = kAway_mm;
    inwards_ = true;
    tip_.active = false;  // lifted, so that it does not sweep from one side to the next
  }

  static constexpr double kAway_mm = 50, kDeepest_mm = 5;  // the body's radius is 40
  RandomStream random_;
  Instrument tip_;
  Vector3d direction_;
  double distance_mm_ = 0, speed_mm_per_s_ = 0;
  bool inwards_ = true;
};

// Every stiffness from jelly to steel at every frame rate: 2,000 steps of deep pokes each.
TEST(Stability, StiffnessAndTimeStepGrid) {
  constexpr double kBounded_mm = 80;        // nothing may be thrown farther than the body is wide
  constexpr double kVolumeRelative = 0.05;  // at 15 Hz a tip crosses half the body in a step
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  for (const double n_per_m : {1e2, 1e3, 1e4, 1e5, 1e6, 1e7}) {
    for (const double rate : {240.0, 60.0, 15.0}) {
      test::BodyOptions body;
      body.stiffness_n_per_mm = n_per_m / 1000;
      DeformOptions options;
      options.time_step_s = 1 / rate;
      Deformer deformer(mesh, test::spring_body(mesh, body), {}, options);
      PokingTip tip(3);
      double farthest = 0, volume_error = 0;
      int recoveries = 0;
      for (int step = 0; step < 2000; ++step) {
        recoveries += deformer.step({tip.advance(options.time_step_s)}).recovered;
        const TriangleMesh now = test::posed(mesh, deformer.positions());
        farthest = std::max(farthest, test::farthest_between(now.vertices, mesh.vertices));
        volume_error =
            std::max(volume_error, std::abs(signed_volume(now) / signed_volume(mesh) - 1));
      }
      const auto where = testing::Message() << n_per_m << " N/m at " << rate << " Hz";
      EXPECT_EQ(recoveries, 0) << where;
      EXPECT_LT(farthest, kBounded_mm) << where;
      EXPECT_LT(volume_error, kVolumeRelative) << where;
      for (int step = 0; step < 2000 && deformer.positions() != mesh.vertices; ++step) {
        deformer.step({});
      }
      EXPECT_TRUE(deformer.positions() == mesh.vertices) << "back at rest, " << where;
    }
  }
}

TEST(Stability, TissueSlipsFromAGrasperThatIsTornAway) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  Deformer deformer(mesh, test::spring_body(mesh), {});
  const Instrument tip = test::grasper_at(mesh.vertices[0]);
  EXPECT_EQ(deformer.step({tip}).slipped, 0u);
  // A thousand kilometres away.
  StepReport report = deformer.step({test::grasper_at({0, 0, 9e8})});
  EXPECT_EQ(report.slipped, 1u);
  EXPECT_FALSE(report.recovered);
  EXPECT_EQ(report.contacts, 0u);
  EXPECT_TRUE(deformer.positions() == mesh.vertices);
  report = deformer.step({tip});
  EXPECT_EQ(report.slipped, 0u);
  EXPECT_TRUE(deformer.positions() == mesh.vertices) << "it holds nothing until it closes again";
}

TEST(Stability, ALostStateGoesBackToRestAndSaysSo) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  Deformer deformer(mesh, test::spring_body(mesh), {});
  std::vector<Vector3d> load(mesh.vertices.size(), Vector3d::Zero());
  load[0].z() = 1e9;  // the largest there may be
  deformer.set_load(load);
  EXPECT_TRUE(deformer.step({}).recovered);
  EXPECT_TRUE(deformer.positions() == mesh.vertices);
  deformer.set_load({});
  EXPECT_FALSE(deformer.step({}).recovered);
  EXPECT_TRUE(deformer.positions() == mesh.vertices);
}

TEST(Stability, HugeAndTinyTips) {
  const TriangleMesh mesh = test::geodesic_sphere(3, 40);
  for (const double radius : {kThinnestTip_mm, 0.1, 60.0, 5000.0}) {
    Deformer deformer(mesh, test::spring_body(mesh), test::sphere_base(mesh, 40, 4));
    for (int step = 0; step < 60; ++step) {
      const StepReport report =
          deformer.step({test::tool_at({1, 2, 41 + radius - 0.2 * step}, Ball{}, radius)});
      ASSERT_FALSE(report.recovered) << radius;
      for (const Vector3d& p : deformer.positions()) ASSERT_LT(p.norm(), 200) << radius;
    }
  }
}

}  // namespace
}  // namespace organbake
