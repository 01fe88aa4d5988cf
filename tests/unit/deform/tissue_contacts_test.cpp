// SPDX-License-Identifier: Apache-2.0

#include "organbake/core/random.h"
#include "organbake/deform/deformer.h"
#include "support/testing.h"
#include "unit/deform/test_bodies.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// What a contact holds to, and what coarse faces cut off between the points that feel: a sphere's
// face 9 mm long on a sphere of 20 mm lets a vertex in by 9²/(8·20).
constexpr double kHeld_mm = 0.1;
constexpr double kBetweenFeelers_mm = 0.5;
constexpr double kAtRest_mm = 1e-3;

struct Organ {
  TriangleMesh mesh;
  MechanicsModel mechanics;
  BaseLayer base;

  DeformBody body() const { return {mesh, mechanics, base}; }
};

Organ ball_at(const Vector3d& center_mm, double radius_mm, double stiffness_n_per_mm = 0.15) {
  Organ organ;
  organ.mesh = test::geodesic_sphere(4, radius_mm);
  for (Vector3d& v : organ.mesh.vertices) v += center_mm;
  organ.mechanics = test::spring_body(organ.mesh, {.stiffness_n_per_mm = stiffness_n_per_mm});
  return organ;
}

// The tip comes from far on the left and pushes the left ball to the right.
StepReport push_right(Deformer& deformer, double depth_mm, int steps = 60) {
  StepReport report;
  for (int step = 0; step <= steps; ++step) {
    report = deformer.step({test::tool_at({-26 + depth_mm * step / steps, 0, 4})});
  }
  return report;
}

// How far the deepest of some vertices lie below another mesh's faces, > 0 inside. Both convex
// enough that the nearest face says on which side a vertex lies.
double deepest_below(const TriangleMesh& mesh, const std::vector<Vector3d>& positions,
                     std::size_t first, const Vector3d* vertices, std::size_t count) {
  TriangleMesh posed = mesh;
  std::copy_n(positions.begin() + static_cast<std::ptrdiff_t>(first), mesh.vertices.size(),
              posed.vertices.begin());
  double deepest = -1e300;
  for (std::size_t v = 0; v < count; ++v) {
    double highest = -1e300;  // inside a convex body every face is above
    for (std::size_t f = 0; f < posed.faces.size(); ++f) {
      const Vector3d from_face = vertices[v] - posed.vertices[posed.faces[f][0]];
      highest = std::max(highest, from_face.dot(face_normal(posed, f)));
    }
    deepest = std::max(deepest, -highest);
  }
  return deepest;
}

TEST(TissueContacts, APushedOrganPushesItsNeighbour) {
  const Organ left = ball_at({0, 0, 0}, 20), right = ball_at({41, 0, 0}, 20);
  Deformer deformer({left.body(), right.body()});
  const StepReport report = push_right(deformer, 16);
  EXPECT_GT(report.tissue_contacts, 0u);
  EXPECT_LT(report.tissue_penetration_mm, kHeld_mm);
  const auto& x = deformer.positions();
  const std::size_t n = left.mesh.vertices.size();
  EXPECT_LT(deepest_below(right.mesh, x, n, x.data(), n), kBetweenFeelers_mm);
  EXPECT_LT(deepest_below(left.mesh, x, 0, x.data() + n, n), kBetweenFeelers_mm);
  double pushed_mm = 0;
  for (std::size_t v = 0; v < n; ++v)
    pushed_mm = std::max(pushed_mm, x[n + v].x() - right.mesh.vertices[v].x());
  EXPECT_GT(pushed_mm, 1);
}

TEST(TissueContacts, WithoutThemOrgansPassThroughEachOther) {
  const Organ left = ball_at({0, 0, 0}, 20), right = ball_at({41, 0, 0}, 20);
  DeformOptions alone;
  alone.tissue_contacts = false;
  Deformer deformer({left.body(), right.body()}, alone);
  EXPECT_EQ(push_right(deformer, 16).tissue_contacts, 0u);
  const auto& x = deformer.positions();
  const std::size_t n = left.mesh.vertices.size();
  EXPECT_GT(deepest_below(right.mesh, x, n, x.data(), n), kBetweenFeelers_mm);
}

// The tool feels the neighbour, too: who stands behind makes the organ harder to push.
TEST(TissueContacts, TheToolFeelsWhatStandsBehind) {
  const Organ left = ball_at({0, 0, 0}, 20), right = ball_at({41, 0, 0}, 20, 1.5);
  Deformer alone({left.body()}), behind({left.body(), right.body()});
  const double free_n = push_right(alone, 16).tip_force_n[0].norm();
  const double held_n = push_right(behind, 16).tip_force_n[0].norm();
  EXPECT_GT(held_n, 1.05 * free_n);
}

// Segmented organs overlap by a voxel or two where they touch. That is their rest.
TEST(TissueContacts, WhatOverlapsAtRestStays) {
  const Organ left = ball_at({0, 0, 0}, 20), right = ball_at({39, 0, 0}, 20);
  Deformer deformer({left.body(), right.body()});
  deformer.set_load(std::vector<Vector3d>(2 * left.mesh.vertices.size(), Vector3d::Zero()));
  for (int step = 0; step < 30; ++step) {
    EXPECT_LT(deformer.step({}).tissue_penetration_mm, kHeld_mm);
  }
  for (std::size_t v = 0; v < left.mesh.vertices.size(); ++v) {
    EXPECT_LT((deformer.positions()[v] - left.mesh.vertices[v]).norm(), kAtRest_mm);
  }
  const StepReport pushed = push_right(deformer, 16);
  EXPECT_GT(pushed.tissue_contacts, 0u);
  EXPECT_LT(pushed.tissue_penetration_mm, kHeld_mm);
}

TEST(TissueContacts, MirroredOrgansMoveMirrored) {
  constexpr double kMirrored_mm = 0.02;  // contacts come in another order
  const Organ left = ball_at({0, 0, 0}, 20), right = ball_at({41, 0, 0}, 20);
  Organ left_mirrored = left, right_mirrored = right;
  left_mirrored.mesh = mirrored(left.mesh), right_mirrored.mesh = mirrored(right.mesh);
  Deformer deformer({left.body(), right.body()});
  Deformer mirrored({left_mirrored.body(), right_mirrored.body()});
  for (int step = 0; step <= 60; ++step) {
    const double x = -26 + 16 * step / 60.;
    deformer.step({test::tool_at({x, 0, 4})});
    mirrored.step({test::tool_at({-x, 0, 4})});
  }
  for (std::size_t v = 0; v < deformer.positions().size(); ++v) {
    const Vector3d p = deformer.positions()[v], q = mirrored.positions()[v];
    EXPECT_LT((p - Vector3d(-q.x(), q.y(), q.z())).norm(), kMirrored_mm) << v;
  }
}

// Two far organs in one world are two organs, whatever differs between them.
TEST(TissueContacts, FarOrgansDontKnowOfEachOther) {
  Organ near = ball_at({0, 0, 0}, 20), far = ball_at({500, 0, 0}, 30, 1.5);
  near.base = test::sphere_base(near.mesh, 21, 6);
  far.mechanics.volume_stiffness = 0.5;
  Deformer both({near.body(), far.body()}), first({near.body()}), second({far.body()});
  for (int step = 0; step <= 60; ++step) {
    const Vector3d at(-26 + 0.2 * step, 0, 4);
    const Instrument at_far = test::tool_at({500 - 36 + 0.2 * step, 0, 4});
    both.step({test::tool_at(at), at_far});
    first.step({test::tool_at(at)});
    second.step({at_far});
  }
  for (std::size_t v = 0; v < near.mesh.vertices.size(); ++v)
    EXPECT_LT((both.positions()[v] - first.positions()[v]).norm(), kHeld_mm);
  for (std::size_t v = 0; v < far.mesh.vertices.size(); ++v)
    EXPECT_LT((both.positions()[near.mesh.vertices.size() + v] - second.positions()[v]).norm(),
              kHeld_mm);
}

TEST(TissueContacts, FiniteElementsOfTwoOrgansKeepTheirOwnStiffness) {
  const TriangleMesh mesh = test::geodesic_sphere(4, 20);
  const MechanicsModel soft = test::fem_ball(mesh);
  MechanicsModel stiff = soft;
  stiff.young_modulus_kpa *= 10;
  stiff.body->poisson_ratio = 0.3;
  DeformOptions options;
  options.solver = TissueSolver::fem;
  const std::vector<Vector3d> load(mesh.vertices.size(), Vector3d(0, 0, -0.002));
  Deformer first({{mesh, soft, {}}}, options), second({{mesh, stiff, {}}}, options);
  TriangleMesh far = mesh;
  for (Vector3d& v : far.vertices) v.x() += 300;
  for (Vector3d& v : stiff.body->nodes_mm) v.x() += 300;
  Deformer both({{mesh, soft, {}}, {far, stiff, {}}}, options);
  first.set_load(load);
  second.set_load(load);
  both.set_load(std::vector<Vector3d>(2 * load.size(), load[0]));
  for (int step = 0; step < 40; ++step) first.step({}), second.step({}), both.step({});
  const std::size_t n = mesh.vertices.size();
  double moved_mm = 0, differs_mm = 0;
  for (std::size_t v = 0; v < n; ++v) {
    const Vector3d moved_stiff = second.positions()[v] - mesh.vertices[v];
    differs_mm = std::max({differs_mm, (both.positions()[v] - first.positions()[v]).norm(),
                           (both.positions()[n + v] - far.vertices[v] - moved_stiff).norm()});
    moved_mm = std::max(moved_mm, (first.positions()[v] - mesh.vertices[v]).norm());
  }
  EXPECT_GT(moved_mm, 0.1);
  EXPECT_LT(differs_mm, 1e-3 * moved_mm);
}

// The upper end is pressed onto the lower one, and goes no further than its skin.
TEST(TissueContacts, AFoldDoesNotPassThroughItself) {
  const auto [mesh, mechanics] = test::bent_tube(0.5);
  const Organ tube{mesh, mechanics, {}};
  const auto closed_by = [&](bool contacts, StepReport& report) {
    DeformOptions options;
    options.tissue_contacts = contacts;
    Deformer deformer({tube.body()}, options);
    for (int step = 0; step <= 120; ++step) {
      const double y_mm = 24 - 0.15 * step;
      report = deformer.step({test::tool_at({30, y_mm, 0})});
    }
    const auto& x = deformer.positions();
    return x[x.size() - 2].y() - x[x.size() - 1].y();  // the ends' middles, lower end last
  };
  StepReport held, passing;
  const double at_rest = tube.mesh.vertices.end()[-2].y() - tube.mesh.vertices.end()[-1].y();
  const double with = closed_by(true, held), without = closed_by(false, passing);
  ASSERT_GT(at_rest, 10);
  EXPECT_LT(without, -1);  // through
  EXPECT_GT(with, -kBetweenFeelers_mm);
  EXPECT_GT(held.tissue_contacts, 0u);
  EXPECT_LT(held.tissue_penetration_mm, kHeld_mm);
}

// Whatever two tools do to three organs that overlap, nothing is lost, and rest is found again.
TEST(TissueContacts, RandomPokesOfOverlappingOrgansEndAtRest) {
  constexpr double kNearRest_mm = 0.05;
  for (const std::uint64_t seed : {2, 3}) {
    RandomStream random(seed);
    const auto place = [&](double x) {
      return Vector3d(x, random.uniform(-4, 4), random.uniform(-4, 4));
    };
    Organ a = ball_at(place(0), 20), b = ball_at(place(38), 20, 0.6), c = ball_at(place(74), 17);
    for (Organ* organ : {&a, &b, &c}) {
      for (Vector3d& v : organ->mesh.vertices)
        v += Vector3d(random.normal(), random.normal(), random.normal()) * 0.5;
      organ->mechanics = test::spring_body(organ->mesh);
    }
    Deformer deformer({a.body(), b.body(), c.body()});
    const std::vector<Vector3d> rest = deformer.positions();
    Vector3d from(-30, 0, 0), to = from;
    for (int step = 0; step < 240; ++step) {
      if (step % 30 == 0) {
        from = to;
        to = Vector3d(random.uniform(-30, 100), random.uniform(-20, 20), random.uniform(-5, 25));
      }
      const Vector3d at = from + (to - from) * (step % 30) / 30.0;
      const StepReport report =
          deformer.step({test::tool_at(at), test::tool_at({80 - at.x(), at.y(), 15})});
      ASSERT_FALSE(report.recovered) << "seed " << seed << ", step " << step;
    }
    for (int step = 0; step < 900; ++step) deformer.step({});
    double farthest_mm = 0;
    for (std::size_t v = 0; v < rest.size(); ++v)
      farthest_mm = std::max(farthest_mm, (deformer.positions()[v] - rest[v]).norm());
    EXPECT_LT(farthest_mm, kNearRest_mm) << "seed " << seed;
  }
}

// Smooth organs that nothing folds have no contacts with themselves, however hard they are poked.
TEST(TissueContacts, APokedBallDoesNotTouchItself) {
  const Organ ball = ball_at({0, 0, 0}, 20);
  DeformOptions alone;
  alone.tissue_contacts = false;
  Deformer with({ball.body()}), without({ball.body()}, alone);
  EXPECT_EQ(push_right(with, 16).tissue_contacts, 0u);
  push_right(without, 16);
  EXPECT_EQ(with.positions(), without.positions());
}

}  // namespace
}  // namespace organbake
