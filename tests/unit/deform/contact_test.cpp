// SPDX-License-Identifier: Apache-2.0

#include "organbake/deform/deformer.h"
#include "organbake/geometry/shell.h"
#include "support/testing.h"
#include "unit/deform/test_bodies.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kOnSphere_mm = 0.1;  // what a contact must hold to

Instrument poke_at(const Vector3d& position_mm, double radius_mm = 5) {
  return test::tool_at(position_mm, Ball{}, radius_mm);
}

// The skin's distance from a point, by the shell map of the geometry module at every base node.
double skin_distance(const TriangleMesh& mesh, const BaseLayer& base, const Vector3d& point) {
  const auto normals = vertex_normals(mesh);
  double nearest = 1e300;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const ShellMatrix m = shell_matrix(mesh, normals, f);
    std::size_t node = std::size_t{f} * base.nodes_per_face();
    for (std::uint32_t i = 0; i <= base.steps; ++i) {
      for (std::uint32_t j = 0; i + j <= base.steps; ++j, ++node) {
        const Vector3d p =
            shell_point(m, double(i) / base.steps, double(j) / base.steps, base.height_mm[node]);
        nearest = std::min(nearest, (p - point).norm());
      }
    }
  }
  return nearest;
}

// Whether a point lies inside, by the solid angle of all faces (Van Oosterom & Strackee 1983).
bool inside(const TriangleMesh& mesh, const Vector3d& point) {
  double solid_angle = 0;
  for (const Face& f : mesh.faces) {
    const Vector3d a = mesh.vertices[f[0]] - point, b = mesh.vertices[f[1]] - point,
                   c = mesh.vertices[f[2]] - point;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    solid_angle += 2 * std::atan2(a.dot(b.cross(c)),
                                  la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return solid_angle > 2 * std::numbers::pi;
}

// Nodes 0.5 mm apart see the sphere's nearest point to 0.25²/2r.
constexpr double kNodeSpacingError_mm = 0.02;

// A tool that is first seen deep in tissue came in by the shortest way: it lies as one that was
// pressed in there.
TEST(Contact, AToolThatBeginsDeepInTissueHasComeInByTheShortestWay) {
  constexpr double kSameForce = 0.15;  // the one was pressed in over a second, the other at once
  constexpr double kRadius_mm = 20, kTip_mm = 3;
  const TriangleMesh mesh = test::geodesic_sphere(4, kRadius_mm);
  const MechanicsModel mechanics = test::spring_body(mesh);
  for (const double depth_mm : {4.0, 6.0, 8.0, 12.0}) {
    const auto at = [&](double depth) {
      return poke_at(Vector3d(0.3, 0.1, kRadius_mm + kTip_mm - depth), kTip_mm);
    };
    Deformer deep(mesh, mechanics, {}), pressed(mesh, mechanics, {});
    StepReport now = deep.step({at(depth_mm)}), slowly;
    EXPECT_GT(now.contacts, 0u) << depth_mm;
    for (int i = 0; i < 240; ++i) now = deep.step({at(depth_mm)});
    for (int i = 0; i < 300; ++i) slowly = pressed.step({at(std::min(1.0, i / 60.0) * depth_mm)});
    EXPECT_LT(now.penetration_mm, kOnSphere_mm) << depth_mm;
    EXPECT_NEAR(now.tip_force_n[0].z(), slowly.tip_force_n[0].z(),
                kSameForce * slowly.tip_force_n[0].z())
        << depth_mm;
  }
}

// Nor does a capsule that lies all inside, or a needle, which comes in along its own axis.
TEST(Contact, CapsulesAndNeedlesThatBeginDeepTouch) {
  const TriangleMesh mesh = test::geodesic_sphere(4, 20);
  const MechanicsModel mechanics = test::spring_body(mesh);
  Instrument capsule = poke_at({-5, 0, 9}, 2);
  capsule.axis_mm = Vector3d(10, 0, 0);
  Deformer deformer(mesh, mechanics, {});
  EXPECT_GT(deformer.step({capsule}).tip_force_n[0].z(), 0.1);
  Instrument needle = poke_at({0, 0, 8}, 0.6);
  needle.kind = Needle{};
  needle.axis_mm = Vector3d(0, 0, 40);
  Deformer pierced(mesh, mechanics, {});
  std::size_t through = 0;
  for (int i = 0; i < 10; ++i) through += pierced.step({needle}).punctures.size();
  EXPECT_EQ(through, 1u);
}

TEST(Contact, AGrasperThatClosesDeepInTissueOrOnAnchorsIsCounted) {
  const TriangleMesh mesh = test::geodesic_sphere(4, 20);
  Instrument grasper = poke_at({0, 0, 5}, 3);
  grasper.kind = Grasper{};
  Deformer deformer(mesh, test::spring_body(mesh), {});
  EXPECT_EQ(deformer.step({grasper}).closed_in_vain, 1u);
  EXPECT_EQ(deformer.step({grasper}).closed_in_vain, 0u);
  for (const auto& [z_mm, in_vain] : {std::pair(19.0, 0u), std::pair(-20.0, 1u)}) {
    grasper.position_mm.z() = z_mm;  // anchors hold what lies below -12
    Deformer other(mesh, test::spring_body(mesh), {});
    EXPECT_EQ(other.step({grasper}).closed_in_vain, in_vain);
    EXPECT_EQ(other.step({grasper}).closed_in_vain, 0u);
  }
}

TEST(Contact, SkinLiesOnTheInstrument) {
  for (const int frequency : {2, 4}) {
    const TriangleMesh mesh = test::lumpy_organ(frequency, 40, 7);
    const BaseLayer base = test::sphere_base(mesh, 40, frequency == 2 ? 40 : 24);
    Deformer deformer(mesh, test::spring_body(mesh), base);
    for (int step = 0; step < 120; ++step) {
      const double depth = std::min(14.0, 0.2 * step);
      const Vector3d at(6 + 0.05 * step, 2, 46 - depth);
      const StepReport report = deformer.step({poke_at(at)});
      if (report.contacts == 0) continue;
      EXPECT_LT(report.penetration_mm, kOnSphere_mm);
      if (step % 10 != 0) continue;
      EXPECT_NEAR(skin_distance(test::posed(mesh, deformer.positions()), base, at), 5,
                  kOnSphere_mm + kNodeSpacingError_mm)
          << "frequency " << frequency << ", step " << step;
    }
  }
}

TEST(Contact, PokeIsLocalAndKeepsTheVolume) {
  constexpr double kVolumeRelative = 0.02;
  constexpr double kFarSideShare = 0.15;  // of the depth, free vertices opposite: pressure bulges
  const TriangleMesh mesh = test::geodesic_sphere(5, 40);
  const MechanicsModel mechanics = test::spring_body(mesh);
  Deformer deformer(mesh, mechanics, {});
  constexpr double kDepth_mm = 24;  // 30 % of the object
  for (int step = 0; step < 90; ++step) {
    deformer.step({poke_at({0, 0, 45 - kDepth_mm * std::min(1.0, step / 45.0)})});
    EXPECT_NEAR(signed_volume(test::posed(mesh, deformer.positions())) / signed_volume(mesh), 1,
                kVolumeRelative);
  }
  for (const std::uint32_t anchor : mechanics.anchors) {
    EXPECT_EQ(deformer.positions()[anchor], mesh.vertices[anchor]);
  }
  // Mean displacement by angle from the poke.
  constexpr int kRings = 6;
  double sum[kRings] = {};
  int count[kRings] = {};
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const double angle = std::acos(std::clamp(mesh.vertices[v].z() / 40, -1.0, 1.0));
    const int ring = std::min(kRings - 1, static_cast<int>(kRings * angle / std::numbers::pi));
    sum[ring] += (deformer.positions()[v] - mesh.vertices[v]).norm();
    ++count[ring];
  }
  EXPECT_GT(sum[0] / count[0], 0.4 * kDepth_mm);
  EXPECT_GT(sum[0] / count[0], sum[1] / count[1]);
  EXPECT_GT(sum[0] / count[0], 3 * sum[3] / count[3]);
  EXPECT_LT(sum[4] / count[4], kFarSideShare * kDepth_mm);
  EXPECT_LT(sum[5] / count[5], 0.01 * kDepth_mm);
}

TEST(Contact, AFastTipDoesNotTunnel) {
  for (const double radius : {2.0, 5.0}) {
    for (const double deep : {25.0, 10.0, 0.0}) {
      const TriangleMesh mesh = test::geodesic_sphere(2, 40);
      const BaseLayer base = test::sphere_base(mesh, 40, 8);
      Deformer deformer(mesh, test::spring_body(mesh), base);
      deformer.step({poke_at({3, 1, 70}, radius)});
      const Vector3d target(3, 1, deep);  // in one step of 1/60 s
      for (int step = 0; step < 10; ++step) deformer.step({poke_at(target, radius)});
      const TriangleMesh now = test::posed(mesh, deformer.positions());
      EXPECT_FALSE(inside(now, target)) << "radius " << radius << ", down to " << deep;
      EXPECT_GT(skin_distance(now, base, target), radius - kOnSphere_mm);
      EXPECT_LT(skin_distance(now, base, target), radius + 2) << "pushed, not thrown";
    }
  }
}

// A hundred radii and more in one step.
TEST(Contact, AThinFastTipDoesNotTunnel) {
  for (const double radius : {1.0, 2.0}) {
    const TriangleMesh mesh = test::geodesic_sphere(2, 40);
    Deformer deformer(mesh, test::spring_body(mesh), test::sphere_base(mesh, 40, 8));
    deformer.step({poke_at({3, 1, 150}, radius)});
    StepReport report;
    for (int step = 0; step < 10; ++step) report = deformer.step({poke_at({3, 1, 30}, radius)});
    EXPECT_GT(report.contacts, 0u) << radius;
    EXPECT_FALSE(inside(test::posed(mesh, deformer.positions()), {3, 1, 30})) << radius;
  }
}

TEST(Contact, ATipThatIsLostOnItsWayIsSaid) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  Deformer deformer(mesh, test::spring_body(mesh), test::sphere_base(mesh, 40, 8));
  deformer.step({poke_at({150, 1, 3}, 2)});
  EXPECT_TRUE(deformer.step({poke_at({-150, 1, 3}, 2)}).tip_too_fast);
  deformer.reset();
  deformer.step({poke_at({3, 1, 20000}, 2)});
  EXPECT_TRUE(deformer.step({poke_at({3, 1, 38}, 2)}).tip_too_fast);
  deformer.reset();
  deformer.step({poke_at({300, 1, 150}, 2)});
  EXPECT_FALSE(deformer.step({poke_at({300, 1, -150}, 2)}).tip_too_fast) << "far from the skin";
}

// Where, how deep and how hard each tip touches: on its sphere, along its radius, and all of it.
TEST(Contact, PointsTellWhatEachTipFeels) {
  const TriangleMesh mesh = test::geodesic_sphere(4, 40);
  Deformer deformer(mesh, test::spring_body(mesh), {});
  StepReport report;
  constexpr double kDepth_mm = 6;
  for (int step = 0; step < 60; ++step) {
    const double in = std::min(kDepth_mm, 0.2 * step);
    report =
        deformer.step({poke_at({0, 0, 45 - in}), poke_at({90, 0, 0}), poke_at({45 - in, 0, 0})});
  }
  ASSERT_EQ(report.contact_points.size(), report.contacts);
  std::vector<Vector3d> force_n(3, Vector3d::Zero());
  double deepest_mm = 0;
  for (const ContactPoint& point : report.contact_points) {
    EXPECT_EQ(point.organ, 0u);
    EXPECT_FALSE(point.carried);
    ASSERT_NE(point.instrument, 1u) << "it touches nothing";
    const Vector3d center = report.tip_position_mm[point.instrument];
    EXPECT_NEAR((point.position_mm - center).norm(), 5, kOnSphere_mm);
    EXPECT_NEAR(point.normal.dot((center - point.position_mm).normalized()), 1, 0.01);
    EXPECT_GT(point.force_n.dot(point.normal), 0) << "tissue pushes, it does not pull";
    deepest_mm = std::max(deepest_mm, point.depth_mm);
    force_n[point.instrument] += point.force_n;
  }
  // Facets of 11 mm lie up to 0.5 mm below the sphere, and contacts beside the deepest place.
  constexpr double kSpread_mm = 1.2;
  EXPECT_NEAR(deepest_mm, kDepth_mm, kSpread_mm);
  for (int tip = 0; tip < 3; ++tip)
    EXPECT_LT((force_n[tip] - report.tip_force_n[tip]).norm(), 1e-12) << tip;
}

// Static equilibrium of the whole: what the anchors hold is what the tip feels.
TEST(Contact, ForceBalancesTheAnchors) {
  constexpr double kBalanceRelative = 0.01;  // held for two seconds; friction still creeps
  const TriangleMesh mesh = test::geodesic_sphere(3, 40);
  test::BodyOptions body;
  body.volume_stiffness = 0;
  const MechanicsModel mechanics = test::spring_body(mesh, body);
  Deformer deformer(mesh, mechanics, {});
  StepReport report;
  for (int step = 0; step < 240; ++step) {
    report = deformer.step({poke_at({0, 0, 45 - std::min(12.0, 0.2 * step)})});
  }
  std::vector<bool> anchored(mesh.vertices.size(), false);
  for (const std::uint32_t a : mechanics.anchors) anchored[a] = true;
  Vector3d on_anchors_n = Vector3d::Zero();
  for (const Spring& s : mechanics.springs) {
    if (anchored[s.a] == anchored[s.b]) continue;
    const std::uint32_t held = anchored[s.a] ? s.a : s.b, loose = anchored[s.a] ? s.b : s.a;
    const Vector3d edge = deformer.positions()[loose] - deformer.positions()[held];
    on_anchors_n += s.stiffness_n_per_mm * (edge.norm() - s.rest_length_mm) * edge.normalized();
  }
  ASSERT_GT(report.tip_force_n.at(0).z(), 0.1);
  EXPECT_LT((report.tip_force_n[0] + on_anchors_n).norm(), kBalanceRelative * on_anchors_n.norm());
}

TEST(Contact, FrictionDragsTheSkin) {
  const TriangleMesh mesh = test::geodesic_sphere(3, 40);
  const auto dragged_mm = [&](double friction) {
    DeformOptions options;
    options.friction = friction;
    Deformer deformer(mesh, test::spring_body(mesh), {}, options);
    for (int step = 0; step < 30; ++step) deformer.step({poke_at({0, 0, 45 - 0.2 * step})});
    for (int step = 0; step < 30; ++step) deformer.step({poke_at({0.15 * step, 0, 39})});
    double sum = 0;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      sum += (deformer.positions()[v] - mesh.vertices[v]).x();
    }
    return sum;
  };
  const double slippery = dragged_mm(0), sticky = dragged_mm(0.8);
  EXPECT_GT(sticky, slippery + 1);
}

// A mirrored body under a mirrored tip moves as the mirror image does.
TEST(Contact, KeepsMirrorSymmetry) {
  constexpr double kSame_mm = 1e-6;  // sums run in another order; contact does not amplify it
  const TriangleMesh mesh = test::lumpy_organ(3, 40, 9);
  const TriangleMesh mirror = mirrored(mesh);
  const MechanicsModel mechanics = test::spring_body(mesh);
  Deformer deformer(mesh, mechanics, {}), reflected(mirror, mechanics, {});
  for (int step = 0; step < 60; ++step) {
    const Vector3d at(8 - 0.1 * step, 3, 47 - 0.3 * step);
    deformer.step({poke_at(at)});
    reflected.step({poke_at({-at.x(), at.y(), at.z()})});
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      const Vector3d& p = deformer.positions()[v];
      const Vector3d& q = reflected.positions()[v];
      ASSERT_LT((Vector3d(-p.x(), p.y(), p.z()) - q).norm(), kSame_mm) << "step " << step;
    }
  }
}

TEST(Contact, TwoTipsPinch) {
  const TriangleMesh mesh = test::geodesic_sphere(3, 40);
  const BaseLayer base = test::sphere_base(mesh, 40, 16);
  Deformer deformer(mesh, test::spring_body(mesh), base);
  StepReport report;
  Vector3d left, right;
  for (int step = 0; step < 60; ++step) {
    left = {-46 + 0.25 * step, 0, 5}, right = {46 - 0.25 * step, 0, 5};
    report = deformer.step({poke_at(left), poke_at(right)});
  }
  EXPECT_LT(report.tip_force_n.at(0).x(), 0);
  EXPECT_GT(report.tip_force_n.at(1).x(), 0);
  const TriangleMesh now = test::posed(mesh, deformer.positions());
  EXPECT_GT(skin_distance(now, base, left), 5 - kOnSphere_mm);
  EXPECT_GT(skin_distance(now, base, right), 5 - kOnSphere_mm);
}

}  // namespace
}  // namespace organbake
