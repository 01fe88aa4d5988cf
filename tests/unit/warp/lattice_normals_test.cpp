// SPDX-License-Identifier: Apache-2.0
#include "light/lattice_normals.h"

#include <gtest/gtest.h>

#include "organbake/core/random.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// A flat square of 20 mm in two faces and, along its diagonal, a sliver of 0.02 mm between them.
TriangleMesh square_with_sliver() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {20, 0, 0}, {20, 20, 0}, {0, 20, 0}, {10.014, 9.986, 0}};
  mesh.faces = {{0, 1, 4}, {1, 2, 4}, {0, 4, 2}, {0, 2, 3}};
  return mesh;
}

BaseLayer layer_of(const TriangleMesh& proxy, double noise_mm) {
  BaseLayer layer;
  layer.steps = 10;
  layer.face_count = static_cast<std::uint32_t>(proxy.faces.size());
  RandomStream random(1);
  for (std::size_t i = 0; i < layer.face_count * std::size_t(layer.nodes_per_face()); ++i)
    layer.height_mm.push_back(static_cast<float>(random.uniform(-noise_mm, noise_mm)));
  return layer;
}

TEST(LatticeNormals, AreThoseOfAFlatFace) {
  const TriangleMesh proxy = square_with_sliver();
  for (const Vector3d& normal : lattice_normals(layer_of(proxy, 0), proxy))
    EXPECT_LT((normal - Vector3d::UnitZ()).norm(), 1e-12);
}

TEST(LatticeNormals, ASliverTakesThoseOfItsRim) {
  const TriangleMesh proxy = square_with_sliver();
  constexpr double kNoise_mm = 0.005;  // of what a sliver's own triangles are high
  for (const Vector3d& normal : lattice_normals(layer_of(proxy, kNoise_mm), proxy))
    EXPECT_GT(normal.z(), 0.99);  // the sliver's own: down to 0.57
}

TEST(LatticeNormals, AreOneWhereFacesMeet) {
  const TriangleMesh proxy = square_with_sliver();
  const BaseLayer layer = layer_of(proxy, 0.3);
  const std::vector<Vector3d> normals = lattice_normals(layer, proxy);
  const auto at = [&](std::uint32_t face, std::uint32_t i, std::uint32_t j) {
    return normals[std::size_t(face) * layer.nodes_per_face() + base_node_index(layer.steps, i, j)];
  };
  for (std::uint32_t k = 0; k <= layer.steps; ++k) {
    EXPECT_EQ(at(2, 0, k), at(3, k, 0));                // edge 0–2
    EXPECT_EQ(at(0, 0, k), at(2, k, 0));                // edge 0–4
    EXPECT_EQ(at(0, layer.steps - k, k), at(1, 0, k));  // edge 1–4
  }
}

// A face cut from its first corner to the middle of the edge across, and a wall: the parts keep the
// normals that their material had, whatever the lips' relief says now; the wall has its own.
TEST(LatticeNormals, OfCutSkinAreThoseOfTheWhole) {
  TriangleMesh whole;
  whole.vertices = {{0, 0, 0}, {20, 0, 0}, {0, 20, 0}, {20, 20, 5}};
  whole.faces = {{0, 1, 2}, {1, 3, 2}};
  std::vector<Eigen::Vector3f> uncut;
  for (const Vector3d& normal : lattice_normals(layer_of(whole, 0.3), whole))
    uncut.push_back(normal.cast<float>());

  const Eigen::Vector2d first(0, 0), second(1, 0), third(0, 1), middle(0.5, 0.5);
  const CutOrgan::FaceParts parts = {
      {0, {{0, {first, second, middle}, {}}, {2, {first, middle, third}, {}}}}};
  TriangleMesh cut = whole;
  cut.vertices.insert(cut.vertices.end(), {{10, 10, 0}, {10, 10, 0}, {0, 0, -9}});
  cut.faces = {{0, 1, 4}, {1, 3, 2}, {0, 5, 2}, {0, 4, 6}};
  const BaseLayer layer = layer_of(cut, 2);
  const std::vector<Vector3d> own = lattice_normals(layer, cut);
  std::vector<Vector3d> kept = own;
  keep_uncut_normals(uncut, parts, layer, kept);

  const std::uint32_t n = layer.steps, nodes = layer.nodes_per_face();
  for (std::uint32_t k = 0; k < nodes; ++k) {
    EXPECT_EQ(kept[nodes + k], uncut[nodes + k].cast<double>());  // not cut
    EXPECT_EQ(kept[3 * nodes + k], own[3 * nodes + k]);           // the wall
  }
  // Even nodes of the parts' edges lie on nodes of the whole.
  for (std::uint32_t k = 0; k <= n; k += 2) {
    const Vector3d lip = uncut[base_node_index(n, k / 2, k / 2)].cast<double>();
    EXPECT_LT((kept[base_node_index(n, 0, k)] - lip).norm(), 1e-6);
    EXPECT_LT((kept[2 * nodes + base_node_index(n, k, 0)] - lip).norm(), 1e-6);
    const Vector3d edge = uncut[base_node_index(n, k, 0)].cast<double>();
    EXPECT_LT((kept[base_node_index(n, k, 0)] - edge).norm(), 1e-6);
  }
}

}  // namespace
}  // namespace organbake
