// SPDX-License-Identifier: Apache-2.0
#include "body/skin.h"

#include <gtest/gtest.h>

#include "body/tissue.h"
#include "organbake/core/random.h"
#include "organbake/deform/deformer.h"
#include "organbake/geometry/shell.h"
#include "solver/constraint_solver.h"
#include "support/meshes.h"
#include "unit/deform/test_bodies.h"

namespace organbake::deform {
namespace {

constexpr double kSkinStep_s = 1.0 / 60;
constexpr double kSame_mm = 1e-9;  // the same formula, summed in another order
// A lattice four times as fine, at 40 mm with 2 mm cells, comes this near to the true nearest
// point.
constexpr double kSampled_mm = 0.08;

struct Posed {
  TriangleMesh mesh = test::lumpy_organ(2, 40, 3);
  BaseLayer base = test::sphere_base(mesh, 42, 8);
  MechanicsModel mechanics = test::spring_body(mesh);
  SpringNetwork network{{{mesh, mechanics, base}}, kSkinStep_s};
  Skin skin{network, {{mesh, mechanics, base}}};
  PaddedVectors x = network.rest();

  // A seeded deformation, in the mesh and in the slots alike.
  Posed() {
    RandomStream random(11);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      mesh.vertices[v] += 2 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
      x[network.slot_of_vertex()[v]] = padded(mesh.vertices[v]);
    }
    skin.pose(x);
  }
};

TEST(Skin, IsTheShellMapOfTheDeformedProxy) {
  Posed p;
  const auto normals = vertex_normals(p.mesh);
  RandomStream random(4);
  for (std::uint32_t f = 0; f < p.mesh.faces.size(); ++f) {
    const double b1 = random.uniform(0, 0.5), b2 = random.uniform(0, 0.5), h = random.normal();
    const Eigen::Vector3d expected = shell_point(shell_matrix(p.mesh, normals, f), b1, b2, h);
    const SkinHit hit = p.skin.hit({f, b1, b2, h}, PaddedVector::Zero());
    EXPECT_LT((hit.point.head<3>() - expected).norm(), kSame_mm);
    EXPECT_NEAR(hit.distance_mm, expected.norm(), kSame_mm);
    EXPECT_NEAR(hit.normal.norm(), 1, kSame_mm);
  }
}

TEST(Skin, AllNormalsAtOnceAreThoseOnDemand) {
  Posed p;
  std::vector<SkinHit> on_demand;
  for (std::uint32_t f = 0; f < p.mesh.faces.size(); ++f)
    on_demand.push_back(p.skin.hit({f, 0.2, 0.3, 1}, PaddedVector::Zero()));
  p.skin.pose(p.x);
  p.skin.pose_all_normals();
  for (std::uint32_t f = 0; f < p.mesh.faces.size(); ++f) {
    const SkinHit at_once = p.skin.hit({f, 0.2, 0.3, 1}, PaddedVector::Zero());
    EXPECT_LT((at_once.point - on_demand[f].point).norm(), kSame_mm);
    EXPECT_LT((at_once.normal - on_demand[f].normal).norm(), kSame_mm);
  }
}

TEST(Skin, NearestPointBeatsAFineSampling) {
  Posed p;
  RandomStream random(5);
  constexpr int kFine = 32;
  for (int trial = 0; trial < 40; ++trial) {
    const auto face = static_cast<std::uint32_t>(random.below(p.mesh.faces.size()));
    // Near the face, as a tip is when it touches.
    const SkinHit start = p.skin.hit({face, 0.3, 0.3, 0}, PaddedVector::Zero());
    const PaddedVector center =
        start.point + random.uniform(2, 8) * start.normal +
        2 * PaddedVector(random.normal(), random.normal(), random.normal(), 0);
    const SkinHit found = p.skin.nearest(face, center);
    double sampled = 1e300;
    for (int i = 0; i <= kFine; ++i) {
      for (int j = 0; i + j <= kFine; ++j) {
        // Heights between nodes: linear in the lattice cell, read off the found surface's own
        // nodes.
        const double u = 8.0 * i / kFine, v = 8.0 * j / kFine;
        const auto cu = std::min<std::uint32_t>(7, u), cv = std::min<std::uint32_t>(7, v);
        if (cu + cv > 7) continue;
        const auto height = [&](std::uint32_t a, std::uint32_t b) {
          return double{p.base.height_mm[face * 45 + base_node_index(8, a, b)]};
        };
        const double s = u - cu, t = v - cv;
        double h = 0;
        if (s + t <= 1) {
          h = (1 - s - t) * height(cu, cv) + s * height(cu + 1, cv) + t * height(cu, cv + 1);
        } else if (cu + cv < 7) {
          h = (1 - t) * height(cu + 1, cv) + (1 - s) * height(cu, cv + 1) +
              (s + t - 1) * height(cu + 1, cv + 1);
        } else {
          continue;
        }
        const SkinHit sample = p.skin.hit({face, u / 8, v / 8, h}, center);
        sampled = std::min(sampled, sample.distance_mm);
      }
    }
    EXPECT_LE(found.distance_mm, sampled + kSampled_mm);
  }
}

TEST(Skin, WithoutABaseItIsTheProxy) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  const MechanicsModel mechanics = test::spring_body(mesh);
  const SpringNetwork network({{mesh, mechanics, {}}}, kSkinStep_s);
  Skin skin(network, {{mesh, mechanics, {}}});
  skin.pose(network.rest());
  const Face& f = mesh.faces[5];
  const Eigen::Vector3d middle =
      (mesh.vertices[f[0]] + mesh.vertices[f[1]] + mesh.vertices[f[2]]) / 3;
  const Eigen::Vector3d out = face_normal(mesh, 5);
  const SkinHit hit = skin.nearest(5, padded(middle + 3 * out));
  EXPECT_NEAR(hit.distance_mm, 3, kSame_mm);
  EXPECT_LT((hit.point.head<3>() - middle).norm(), kSame_mm);
  EXPECT_NEAR(skin.least_distance(5, padded(middle + 3 * out)), 3, kSame_mm);
}

TEST(Skin, ACollapsedFaceStillHasANearestPoint) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  const MechanicsModel mechanics = test::spring_body(mesh);
  const SpringNetwork network({{mesh, mechanics, {}}}, kSkinStep_s);
  Skin skin(network, {{mesh, mechanics, test::sphere_base(mesh, 41, 4)}});
  const PaddedVectors collapsed(network.size(), PaddedVector(1, 2, 3, 0));
  skin.pose(collapsed);
  const SkinHit hit = skin.nearest(0, PaddedVector(1, 2, 8, 0));
  EXPECT_TRUE(hit.point.allFinite());
  EXPECT_LT(hit.distance_mm, 8);
}

// A smooth skin whose nodes lie on the proxy's faces is met where the proxy is.
TEST(Skin, ASmoothOneIsMetWhereItsNodesLie) {
  TriangleMesh mesh = test::lumpy_organ(2, 40, 3);
  const MechanicsModel mechanics = test::spring_body(mesh);
  const SmoothSkin smooth = flat_skin(mesh, 3);
  const BaseLayer none;
  const DeformBodies with = {{mesh, mechanics, none, &smooth}}, without = {{mesh, mechanics, none}};
  const SpringNetwork network(without, kSkinStep_s);
  Skin skin(network, with), proxy(network, without);
  PaddedVectors x = network.rest();
  RandomStream random(12);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    x[network.slot_of_vertex()[v]] +=
        PaddedVector(2 * random.normal(), 2 * random.normal(), 2 * random.normal(), 0);
  skin.pose(x), proxy.pose(x);
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    ASSERT_TRUE(skin.smooth(f));
    const SkinHit start = proxy.hit({f, 0.3, 0.4, 0}, PaddedVector::Zero());
    const PaddedVector center = start.point + 4 * start.normal +
                                PaddedVector(random.normal(), random.normal(), random.normal(), 0);
    const SkinHit found = skin.nearest(f, center), expected = proxy.nearest(f, center);
    EXPECT_NEAR(found.distance_mm, expected.distance_mm, kSame_mm);
    EXPECT_LT((found.point - expected.point).norm(), 1e-6);
    EXPECT_LE(skin.least_distance(f, center), found.distance_mm + kSame_mm);
    const Skin::Box box = skin.node_box(f);
    EXPECT_TRUE((found.point.array() >= box.low.array() - kSame_mm).all());
    EXPECT_TRUE((found.point.array() <= box.high.array() + kSame_mm).all());
  }
}

// A tip that sinks into a smooth skin pushes it as it pushes the proxy that the nodes lie on.
TEST(Skin, ATipPushesASmoothOneAsItPushesTheProxy) {
  const TriangleMesh mesh = test::geodesic_sphere(2, 40);
  const MechanicsModel mechanics = test::spring_body(mesh);
  const SmoothSkin smooth = flat_skin(mesh, 2);
  const BaseLayer none;
  Deformer with(DeformBodies{{mesh, mechanics, none, &smooth}}),
      without(DeformBodies{{mesh, mechanics, none}});
  double force_N = 0;
  for (int step = 0; step < 60; ++step) {
    Instrument tip;
    tip.position_mm = {0, 0, 46 - std::min(0.4 * step, 12.0)};
    tip.active = true;
    const StepReport report = with.step({tip});
    without.step({tip});
    force_N = std::max(force_N, report.tip_force_n.front().norm());
  }
  EXPECT_GT(force_N, 0);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    EXPECT_LT((with.positions()[v] - without.positions()[v]).norm(), 0.2) << "vertex " << v;
}

constexpr double kTimeStep_s = 1.0 / 60;
constexpr double kRelative = 1e-12;           // of sums over a hundred faces
constexpr double kDifferenceRelative = 1e-6;  // of a central difference of a cubic, 1e-4 mm steps

TEST(EnclosedVolume, MeasuresTheMesh) {
  const TriangleMesh mesh = test::lumpy_organ(3, 40, 1);
  const SpringNetwork network({{mesh, test::spring_body(mesh), {}}}, kTimeStep_s);
  const EnclosedVolume volume(network, {1});
  ASSERT_EQ(volume.bodies().size(), 1u);
  EXPECT_NEAR(volume.bodies()[0].rest_mm3 / signed_volume(mesh), 1, kRelative);
  EXPECT_EQ(volume.bodies()[0].compliance, 0);
}

TEST(EnclosedVolume, GradientIsTheDerivative) {
  const TriangleMesh mesh = test::lumpy_organ(2, 40, 2);
  const SpringNetwork network({{mesh, test::spring_body(mesh), {}}}, kTimeStep_s);
  const EnclosedVolume volume(network, {1});
  PaddedVectors x = network.rest(), gradient(x.size());
  volume.gradient(x, gradient);
  constexpr double kStep_mm = 1e-4;
  std::vector<double> above, below;
  for (const std::size_t slot : {std::size_t{0}, std::size_t{7}, network.free_count() - 1}) {
    for (int axis = 0; axis < 3; ++axis) {
      x[slot][axis] += kStep_mm;
      volume.measure(x, above);
      x[slot][axis] -= 2 * kStep_mm;
      volume.measure(x, below);
      x[slot][axis] += kStep_mm;
      EXPECT_NEAR((above[0] - below[0]) / (2 * kStep_mm), gradient[slot][axis],
                  kDifferenceRelative * gradient[slot].norm());
    }
  }
  for (std::size_t slot = network.free_count(); slot < x.size(); ++slot) {
    EXPECT_TRUE(gradient[slot].isZero(0)) << "anchors don't move";
  }
}

TEST(EnclosedVolume, ZeroStiffnessAndOpenSurfacesHaveNone) {
  TriangleMesh mesh = test::geodesic_sphere(3, 40);
  const MechanicsModel mechanics = test::spring_body(mesh);
  EXPECT_TRUE(
      EnclosedVolume(SpringNetwork({{mesh, mechanics, {}}}, kTimeStep_s), {0}).bodies().empty());
  // The face farthest from the anchors goes: an open edge that moves.
  std::size_t top = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    if (mesh.vertices[mesh.faces[f][0]].z() > mesh.vertices[mesh.faces[top][0]].z()) top = f;
  }
  mesh.faces.erase(mesh.faces.begin() + static_cast<std::ptrdiff_t>(top));
  EXPECT_TRUE(
      EnclosedVolume(SpringNetwork({{mesh, mechanics, {}}}, kTimeStep_s), {1}).bodies().empty());
}

TEST(EnclosedVolume, AnOpenEdgeBetweenAnchorsIsAllowed) {
  TriangleMesh mesh = test::geodesic_sphere(4, 40);
  const MechanicsModel mechanics = test::spring_body(mesh);
  std::vector<bool> anchored(mesh.vertices.size(), false);
  for (const std::uint32_t a : mechanics.anchors) anchored[a] = true;
  const std::size_t before = mesh.faces.size();
  std::erase_if(mesh.faces,
                [&](const Face& f) { return anchored[f[0]] && anchored[f[1]] && anchored[f[2]]; });
  ASSERT_LT(mesh.faces.size(), before);
  EXPECT_EQ(
      EnclosedVolume(SpringNetwork({{mesh, mechanics, {}}}, kTimeStep_s), {1}).bodies().size(), 1u);
}

TEST(EnclosedVolume, SeparatePartsKeepTheirOwn) {
  TriangleMesh mesh = test::geodesic_sphere(2, 40);
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  MechanicsModel mechanics = test::spring_body(mesh);
  const TriangleMesh other = test::geodesic_sphere(1, 10);
  const MechanicsModel other_mechanics = test::spring_body(other);
  for (const auto& v : other.vertices) mesh.vertices.push_back(v + Eigen::Vector3d(80, 0, 0));
  for (const Face& f : other.faces) {
    mesh.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
  }
  for (Spring s : other_mechanics.springs) {
    s.a += first, s.b += first;
    mechanics.springs.push_back(s);
  }
  mechanics.mass_kg.insert(mechanics.mass_kg.end(), other_mechanics.mass_kg.begin(),
                           other_mechanics.mass_kg.end());
  const SpringNetwork network({{mesh, mechanics, {}}}, kTimeStep_s);
  const EnclosedVolume volume(network, {0.5});
  ASSERT_EQ(volume.bodies().size(), 2u);
  EXPECT_NEAR(volume.bodies()[1].rest_mm3 / signed_volume(other), 1, kRelative);
  EXPECT_GT(volume.bodies()[0].compliance, 0);
}

}  // namespace
}  // namespace organbake::deform
