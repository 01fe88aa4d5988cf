// SPDX-License-Identifier: Apache-2.0
#include "body/skin.h"

#include "body/tissue.h"
#include "organbake/core/random.h"
#include "organbake/deform/deformer.h"
#include "organbake/geometry/shell.h"
#include "solver/shape_solver.h"
#include "support/meshes.h"
#include "support/testing.h"
#include "unit/deform/test_bodies.h"

namespace organbake::deform {
namespace {

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

// Heights that are linear over a face are so between its nodes, whichever way a cell is cut.
TEST(Skin, LiesBetweenItsNodes) {
  const TriangleMesh mesh = test::geodesic_sphere(1, 40);
  const MechanicsModel mechanics = test::spring_body(mesh);
  BaseLayer base;
  base.steps = 3;
  base.face_count = static_cast<std::uint32_t>(mesh.faces.size());
  for (std::uint32_t f = 0; f < base.face_count; ++f)
    each_node(base.steps, [&](std::uint32_t i, std::uint32_t j, std::uint32_t) {
      base.height_mm.push_back(1.0f + static_cast<float>(i) + 10 * static_cast<float>(j));
    });
  const DeformBodies bodies{{mesh, mechanics, base}};
  const SpringNetwork tissue(bodies, kTimeStep_s);
  const Skin skin(tissue, bodies);
  RandomStream random(1);
  for (int k = 0; k < 100; ++k) {
    const double b1 = random.uniform(0, 1), b2 = random.uniform(0, 1 - b1);
    EXPECT_NEAR(skin.point_over(0, b1, b2).height_mm, 1 + 3 * b1 + 30 * b2, 1e-9)
        << b1 << ' ' << b2;
  }
}
constexpr double kRelative = 1e-12;  // of sums over a hundred faces

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
