// SPDX-License-Identifier: Apache-2.0
#include "solver/body_pressures.h"

#include <gtest/gtest.h>

#include "solver/spring_network.h"
#include "unit/deform/test_bodies.h"

namespace organbake::deform {
namespace {

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
