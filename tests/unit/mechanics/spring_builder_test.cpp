// SPDX-License-Identifier: GPL-3.0-or-later
#include "spring_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "organbake/mechanics/mechanics.h"
#include "support/meshes.h"

namespace organbake {
namespace {

constexpr double kRounding = 1e-14;  // a handful of operations on numbers of about 1

// 10 kPa over 100 mm² and 50 mm: 1e4 N/m² · 1e-4 m² / 0.05 m = 20 N/m = 0.02 N/mm.
TEST(SpringBuilder, ABarHasTheStiffnessOfTissue) {
  TriangleMesh mesh = tetrahedron_mesh();
  mesh.vertices[1] = {50, 0, 0};
  SpringBuilder network(mesh, 10);
  ASSERT_TRUE(network.add_bar(1, 0, 100));
  // m = 0.2·0.3/0.5 = 0.12 kg; critical: 2√(20 N/m · 0.12 kg) = 2√2.4 N·s/m.
  const std::vector<Spring> springs = network.springs({0.2, 0.3, 1, 1}, 0.5);
  ASSERT_EQ(springs.size(), 1u);
  EXPECT_EQ(springs[0].a, 0u);
  EXPECT_EQ(springs[0].b, 1u);
  EXPECT_NEAR(springs[0].rest_length_mm, 50, kRounding);
  EXPECT_NEAR(springs[0].stiffness_n_per_mm, 0.02, kRounding);
  EXPECT_NEAR(springs[0].damping_n_s_per_mm, std::sqrt(2.4) * 1e-3, kRounding);
}

TEST(SpringBuilder, BarsBetweenTheSameTwoAddUp) {
  const TriangleMesh mesh = tetrahedron_mesh();
  SpringBuilder network(mesh, 1000);
  network.add_bar(0, 1, 1);
  network.add_bar(1, 0, 2);
  const std::vector<Spring> springs = network.springs({1, 1, 1, 1}, 0);
  ASSERT_EQ(springs.size(), 1u);
  EXPECT_NEAR(springs[0].stiffness_n_per_mm, 3, kRounding);
  EXPECT_EQ(springs[0].damping_n_s_per_mm, 0);
}

TEST(SpringBuilder, CoincidentVerticesGetNoSpring) {
  TriangleMesh mesh = tetrahedron_mesh();
  mesh.vertices[3] = mesh.vertices[0];
  SpringBuilder network(mesh, 10);
  EXPECT_FALSE(network.add_bar(0, 3, 1));
  EXPECT_TRUE(network.springs({1, 1, 1, 1}, 1).empty());
}

std::size_t part_count(const TriangleMesh& mesh, const MechanicsModel& model) {
  SpringBuilder network(mesh, 1);
  for (const Spring& s : model.springs) network.add_bar(s.a, s.b, 1);
  const std::vector<std::uint32_t> parts = network.parts();
  return std::set<std::uint32_t>(parts.begin(), parts.end()).size();
}

TEST(MakeMechanics, PartsOfAnOrganHangTogether) {
  TriangleMesh organ = sphere_mesh(20, 1);
  for (const double x : {60.0, 100.0, 400.0}) {
    organ = joined(organ, moved(sphere_mesh(15, 0), {x, 5, 0}));
  }
  EXPECT_EQ(part_count(organ, make_mechanics(organ, {})), 1u);
}

// Parts that lie on top of each other vertex by vertex have no length between their twins.
TEST(MakeMechanics, CoincidentPartsHangTogether) {
  const TriangleMesh twice = joined(sphere_mesh(20, 0), sphere_mesh(20, 0));
  EXPECT_EQ(part_count(twice, make_mechanics(twice, {})), 1u);
}

// A face on an edge of two others, an opposite pair, a needle and a face without area.
TEST(MakeMechanics, BrokenProxiesStillGetSoundSprings) {
  TriangleMesh mesh = lumpy_mesh(30, 1);
  const Face f = mesh.faces[0];
  mesh.vertices.push_back({60, 60, 60});
  mesh.vertices.push_back(0.5 * (mesh.vertices[f[0]] + mesh.vertices[f[1]]));
  const auto far = static_cast<std::uint32_t>(mesh.vertices.size() - 2);
  mesh.faces.push_back({f[0], f[1], far});
  mesh.faces.push_back({f[1], f[0], far});
  mesh.faces.push_back({f[0], f[1], far + 1});
  mesh.faces.push_back({f[2], f[2], f[0]});
  const MechanicsModel model = make_mechanics(mesh, {});
  for (const Spring& s : model.springs) {
    ASSERT_TRUE(s.rest_length_mm > 0 && s.stiffness_n_per_mm > 0 && s.damping_n_s_per_mm > 0);
    ASSERT_TRUE(std::isfinite(s.stiffness_n_per_mm));
  }
  for (const double mass : model.mass_kg) ASSERT_GT(mass, 0);
}

TEST(MakeMechanics, AtLeastThreeAnchorsAndNeverAll) {
  MechanicsOptions options;
  options.anchor_fraction = 0;
  EXPECT_EQ(make_mechanics(lumpy_mesh(30, 1), options).anchors.size(), 3u);
  options.anchor_fraction = 0.9;
  EXPECT_EQ(make_mechanics(tetrahedron_mesh(), options).anchors.size(), 3u);
  TriangleMesh one;
  one.vertices = {{0, 0, 0}, {9, 0, 0}, {0, 9, 0}};
  one.faces = {{0, 1, 2}};
  EXPECT_EQ(make_mechanics(one, options).anchors.size(), 2u);
}

TEST(MakeMechanics, IsRepeatable) {
  const TriangleMesh mesh = lumpy_mesh(30, 2);
  EXPECT_EQ(mechanics_to_json(make_mechanics(mesh, {})),
            mechanics_to_json(make_mechanics(mesh, {})));
}

}  // namespace
}  // namespace organbake
