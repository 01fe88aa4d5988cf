// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "organbake/core/random.h"
#include "organbake/deform/deformer.h"
#include "unit/deform/test_bodies.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

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
        TriangleMesh now = mesh;
        now.vertices = deformer.positions();
        for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
          farthest = std::max(farthest, (now.vertices[v] - mesh.vertices[v]).norm());
        }
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
  Instrument tip;
  tip.active = true;
  tip.kind = Grasper{};
  tip.position_mm = mesh.vertices[0];
  EXPECT_EQ(deformer.step({tip}).slipped, 0u);
  tip.position_mm = {0, 0, 9e8};  // a thousand kilometres away
  StepReport report = deformer.step({tip});
  EXPECT_EQ(report.slipped, 1u);
  EXPECT_FALSE(report.recovered);
  EXPECT_EQ(report.contacts, 0u);
  EXPECT_TRUE(deformer.positions() == mesh.vertices);
  tip.position_mm = mesh.vertices[0];
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
    Instrument tip;
    tip.active = true;
    tip.radius_mm = radius;
    for (int step = 0; step < 60; ++step) {
      tip.position_mm = {1, 2, 41 + radius - 0.2 * step};
      const StepReport report = deformer.step({tip});
      ASSERT_FALSE(report.recovered) << radius;
      for (const Vector3d& p : deformer.positions()) ASSERT_LT(p.norm(), 200) << radius;
    }
  }
}

}  // namespace
}  // namespace organbake
