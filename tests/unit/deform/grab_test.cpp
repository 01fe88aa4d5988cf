// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "organbake/deform/deformer.h"
#include "organbake/geometry/shell_map.h"
#include "unit/deform/test_bodies.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

constexpr double kFollows_mm = 0.1;

Instrument grasper(const Vector3d& position_mm, bool closed = true, double radius_mm = 5) {
  Instrument tip;
  tip.position_mm = position_mm;
  tip.radius_mm = radius_mm;
  tip.kind = Grasper{};
  tip.active = closed;
  return tip;
}

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
  StepReport report = deformer.step({grasper(start)});
  EXPECT_LT((deformer.positions()[s.top] - start).norm(), kFollows_mm) << "closing pulls nothing";
  for (int step = 1; step <= 60; ++step) {
    const Vector3d drag(0.2 * step, 0.1 * step, 0.15 * step);
    report = deformer.step({grasper(start + drag)});
    EXPECT_LT((deformer.positions()[s.top] - start - drag).norm(), kFollows_mm) << step;
  }
  EXPECT_LT(report.tip_force_n.at(0).dot(Vector3d(2, 1, 1.5)), 0) << "the tissue pulls back";
  // It opens: the tissue goes home.
  for (int step = 0; step < 1200; ++step) deformer.step({grasper(start, false)});
  EXPECT_TRUE(deformer.positions() == s.mesh.vertices);
}

TEST(Grab, ReachesTheNearestSkinWithinTwoRadii) {
  const Sphere s;
  const Vector3d up = s.mesh.vertices[s.top].normalized();
  for (const double gap_mm : {6.0, 9.5, 11.0}) {
    Deformer deformer(s.mesh, s.mechanics, {});
    const Vector3d start = (40 + gap_mm) * up;
    deformer.step({grasper(start)});
    deformer.step({grasper(start + 5 * up)});
    const double lifted = (deformer.positions()[s.top] - s.mesh.vertices[s.top]).dot(up);
    // It keeps its distance from the tip; it does not jump to it.
    EXPECT_NEAR(lifted, gap_mm < 10 ? 5 : 0, kFollows_mm) << "gap " << gap_mm;
  }
}

TEST(Grab, ClosesOnlyOnce) {
  const Sphere s;
  Deformer deformer(s.mesh, s.mechanics, {});
  // Closed in the air, then moved through the skin: it carries nothing and pushes nothing.
  for (int step = 0; step < 40; ++step) deformer.step({grasper({0, 0, 60.0 - step})});
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
  deformer.step({grasper(start, true, 3)});
  for (int step = 1; step <= 30; ++step) {
    const Vector3d pull = 0.2 * step * start.normalized();
    deformer.step({grasper(start + pull, true, 3)});
    EXPECT_LT((skin(deformer.positions()) - start - pull).norm(), kFollows_mm) << step;
  }
}

TEST(Grab, APokeMayTurnIntoAGrab) {
  const Sphere s;
  Deformer deformer(s.mesh, s.mechanics, {});
  Instrument tip = grasper({0, 0, 46});
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

// Two graspers that tear one place apart contradict each other; the answer stays finite.
TEST(Grab, ContradictionsStayFinite) {
  const Sphere s;
  Deformer deformer(s.mesh, s.mechanics, {});
  const Vector3d at = s.mesh.vertices[s.top];
  for (int step = 0; step < 300; ++step) {
    const Vector3d apart(0.1 * std::min(step, 200), 0, 0);
    const StepReport report = deformer.step({grasper(at + apart), grasper(at - apart)});
    ASSERT_TRUE(report.tip_force_n.at(0).allFinite());
    ASSERT_LT(report.tip_force_n[0].norm(), 1e6);
    ASSERT_FALSE(report.recovered);
  }
}

}  // namespace
}  // namespace organbake
