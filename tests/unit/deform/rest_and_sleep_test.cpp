// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "organbake/deform/deformer.h"
#include "unit/deform/test_bodies.h"

namespace organbake {
namespace {

Instrument tip_at(const Eigen::Vector3d& position_mm, bool active = true) {
  Instrument tip;
  tip.position_mm = position_mm;
  tip.active = active;
  return tip;
}

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
  const std::vector<Instrument> away = {tip_at({0, 0, 80}), tip_at({0, 0, 0}, false)};
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
  Deformer deformer(mesh, test::spring_body(mesh), {});
  for (int step = 0; step < 100; ++step) {
    deformer.step({tip_at({step * 0.1 - 5, 0, 45.5})});
    EXPECT_FALSE(deformer.moved());
  }
  EXPECT_TRUE(deformer.positions() == mesh.vertices);
}

TEST(Deformer, ReleaseReturnsToRestExactlyAndSleeps) {
  for (const double stiffness : {0.1, 10.0, 1e4}) {
    const TriangleMesh mesh = test::geodesic_sphere(2, 40);
    test::BodyOptions body;
    body.stiffness_n_per_mm = stiffness;
    Deformer deformer(mesh, test::spring_body(mesh, body), test::sphere_base(mesh, 40, 6));
    for (int step = 0; step < 60; ++step) deformer.step({tip_at({4, 3, 46 - 0.35 * step})});
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
    deformer.step({tip_at(at)});
    slept = !deformer.moved();
  }
  EXPECT_TRUE(trembled);
  EXPECT_TRUE(slept);
}

TEST(Deformer, SleepsUnderAStillTipAndWakesWithIt) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  Deformer deformer(mesh, test::spring_body(mesh), {});
  for (int step = 0; step < 30; ++step) deformer.step({tip_at({0, 0, 46 - 0.5 * step})});
  const std::vector<Instrument> held = {tip_at({0, 0, 31})};
  constexpr int kLimit = 600;  // 10 s
  ASSERT_GE(steps_to_sleep(deformer, held, kLimit), 1);
  const StepReport asleep = deformer.step(held);
  EXPECT_GT(asleep.contacts, 0u);
  EXPECT_GT(asleep.tip_force_n.at(0).z(), 0) << "the force is still reported";

  deformer.step({tip_at({0, 0, 30})});
  EXPECT_TRUE(deformer.moved());
  steps_to_sleep(deformer, {tip_at({0, 0, 30})}, kLimit);
  deformer.step({});
  EXPECT_TRUE(deformer.moved()) << "a tip that goes away wakes what it held";
}

TEST(Deformer, ResetIsRest) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  Deformer deformer(mesh, test::spring_body(mesh), {});
  for (int step = 0; step < 20; ++step) deformer.step({tip_at({0, 0, 46 - 0.5 * step})});
  deformer.reset();
  EXPECT_TRUE(deformer.positions() == mesh.vertices);
  deformer.step({});
  EXPECT_FALSE(deformer.moved());
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
  TriangleMesh shrunk = mesh;
  shrunk.vertices = deformer.positions();
  EXPECT_LT(signed_volume(shrunk), 0.95 * signed_volume(mesh));
}

// The same script gives the same bits, also after a reset.
TEST(Deformer, RepeatsExactly) {
  const TriangleMesh mesh = test::lumpy_organ(3, 40, 6);
  const MechanicsModel mechanics = test::spring_body(mesh);
  Deformer one(mesh, mechanics, {}), two(mesh, mechanics, {});
  const auto play = [](Deformer& d) {
    for (int step = 0; step < 40; ++step) d.step({tip_at({0.2 * step, 0, 46 - 0.5 * step})});
    return d.positions();
  };
  const auto first = play(one);
  EXPECT_TRUE(first == play(two));
  one.reset();
  EXPECT_TRUE(first == play(one));
}

}  // namespace
}  // namespace organbake
