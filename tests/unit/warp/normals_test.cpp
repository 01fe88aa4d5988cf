// SPDX-License-Identifier: Apache-2.0
#include "light/relit_skin.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "organbake/core/random.h"
#include "support/synthetic_bundle.h"

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

using Eigen::Matrix3d;
using Eigen::Vector3d;

TriangleMesh ball() { return SyntheticOrgan{}.mesh(2); }

// The mesh with a vertex in its first face, so near the face's first edge that it makes a sliver
// there, the last face.
TriangleMesh with_sliver(TriangleMesh mesh) {
  const Face face = mesh.faces[0];
  const auto near_edge = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.emplace_back(0.495 * (mesh.vertices[face[0]] + mesh.vertices[face[1]]) +
                             0.01 * mesh.vertices[face[2]]);
  mesh.faces[0] = {near_edge, face[1], face[2]};
  mesh.faces.push_back({face[0], near_edge, face[2]});
  mesh.faces.push_back({face[0], face[1], near_edge});
  return mesh;
}

void place(NormalTransport& turns, const TriangleMesh& posed, std::vector<std::uint8_t>& turned) {
  turns.place(shell_matrices(posed), std::vector<std::uint8_t>(posed.faces.size(), 1), turned);
}

constexpr double kFloatRounding = 1e-6;  // of entries about 1, a few products and sums

Matrix3d turn_at(const NormalTransport& turns, std::uint32_t face, double b1, double b2) {
  return turns.on(face).at(float(b1), float(b2)).topRows<3>().cast<double>();
}

TEST(NormalTransport, ATurnedProxyTurnsItsNormals) {
  const Matrix3d turn = Eigen::AngleAxisd(0.8, Vector3d(1, 2, -1).normalized()).matrix();
  TriangleMesh proxy = with_sliver(ball());
  NormalTransport turns{ShellSurface(proxy)};
  for (Vector3d& v : proxy.vertices) v = turn * v;
  std::vector<std::uint8_t> turned(proxy.faces.size());
  place(turns, proxy, turned);
  for (std::uint32_t f = 0; f < proxy.faces.size(); ++f) {
    EXPECT_TRUE(turned[f]);
    EXPECT_FALSE(turns.at_rest(f));
    EXPECT_LT((turn_at(turns, f, 0.2, 0.5) - turn).norm(), kFloatRounding);
  }
}

// Of a vertex whose faces are all folded or without area no gradient is known: it turns with what
// lies about it.
TEST(NormalTransport, AKnotBetweenCollapsedFacesTurnsWithTheOthers) {
  const Matrix3d turn = Eigen::AngleAxisd(1.2, Vector3d(1, 2, -1).normalized()).matrix();
  TriangleMesh proxy = ball();
  const Face face = proxy.faces[0];
  const auto middle = static_cast<std::uint32_t>(proxy.vertices.size());
  proxy.vertices.push_back(proxy.vertices[face[0]]);  // upon a corner
  proxy.faces[0] = {middle, face[1], face[2]};
  proxy.faces.push_back({face[0], middle, face[2]});
  proxy.faces.push_back({face[0], face[1], middle});
  NormalTransport turns{ShellSurface(proxy)};
  for (Vector3d& v : proxy.vertices) v = turn * v;
  std::vector<std::uint8_t> turned(proxy.faces.size());
  place(turns, proxy, turned);
  for (std::uint32_t f = 0; f < proxy.faces.size(); ++f) {
    for (const auto& [b1, b2] : {std::pair(0.0, 0.0), {0.5, 0.0}, {0.5, 0.5}, {0.3, 0.3}})
      EXPECT_LT((turn_at(turns, f, b1, b2) - turn).norm(), kFloatRounding) << "face " << f;
  }
}

TEST(NormalTransport, OnlyFacesNearWhatMovedAreTurnedAndComeBackToTheBit) {
  const TriangleMesh rest = ball();
  TriangleMesh pushed = rest;
  pushed.vertices[0] *= 0.9;
  NormalTransport turns{ShellSurface(rest)};
  std::vector<std::uint8_t> turned(rest.faces.size());
  place(turns, pushed, turned);
  const auto count = std::count(turned.begin(), turned.end(), 1);
  EXPECT_GE(count, 5);
  EXPECT_LT(count, static_cast<std::ptrdiff_t>(rest.faces.size()) / 2);
  for (std::uint32_t f = 0; f < turned.size(); ++f) EXPECT_EQ(turns.at_rest(f), !turned[f]);
  place(turns, rest, turned);
  for (std::uint32_t f = 0; f < turned.size(); ++f) EXPECT_TRUE(turns.at_rest(f));
}

TEST(NormalTransport, NormalsAreContinuousOverEdges) {
  const TriangleMesh rest = ball();
  TriangleMesh bent = rest;
  for (Vector3d& v : bent.vertices) v += Vector3d(0, 4 * std::sin(v.x() / 9), 3 * std::cos(v.y()));
  NormalTransport turns{ShellSurface(rest)};
  std::vector<std::uint8_t> turned(rest.faces.size());
  place(turns, bent, turned);
  const auto along = [&](std::uint32_t f, std::uint32_t a, std::uint32_t b, double share) {
    std::array<double, 3> at{};
    for (int k = 0; k < 3; ++k) {
      if (rest.faces[f][k] == a) at[k] = 1 - share;
      if (rest.faces[f][k] == b) at[k] = share;
    }
    return turn_at(turns, f, at[1], at[2]);
  };
  int shared = 0;
  for (std::uint32_t f = 0; f < rest.faces.size(); ++f) {
    for (std::uint32_t g = 0; g < f; ++g) {
      std::vector<std::uint32_t> common;
      for (const std::uint32_t v : rest.faces[f]) {
        if (std::count(rest.faces[g].begin(), rest.faces[g].end(), v)) common.push_back(v);
      }
      if (common.size() != 2) continue;
      ++shared;
      for (const double share : {0.0, 0.3, 0.5, 1.0}) {
        EXPECT_LT(
            (along(f, common[0], common[1], share) - along(g, common[0], common[1], share)).norm(),
            kFloatRounding);
      }
    }
  }
  EXPECT_EQ(shared, static_cast<int>(rest.faces.size()) * 3 / 2);
}

// A sliver's own gradient turns by anything: its vertices lie on a line but for a hair's breadth.
TEST(NormalTransport, ASliverHardlyTurnsTheSkinAboutIt) {
  const TriangleMesh rest = with_sliver(ball());
  TriangleMesh moved = rest;
  const Vector3d outward = face_normal(rest, 0);
  moved.vertices.back() += 0.5 * outward;  // the sliver is 0.3 mm high
  ASSERT_LT(face_normal(moved, rest.faces.size() - 1).dot(outward), 0.6);
  NormalTransport turns{ShellSurface(rest)};
  std::vector<std::uint8_t> turned(rest.faces.size());
  place(turns, moved, turned);
  constexpr double kMostTurn = 0.1;  // rad; by angles it was 0.5
  const auto sliver = static_cast<std::uint32_t>(rest.faces.size() - 1);
  for (const std::uint32_t f : {0u, sliver - 1, sliver}) {
    for (const auto& [b1, b2] : {std::pair(0.0, 0.0), {0.5, 0.0}, {0.5, 0.5}, {0.3, 0.3}}) {
      const Vector3d normal = (turn_at(turns, f, b1, b2) * outward).normalized();
      EXPECT_LT(std::acos(normal.dot(outward)), kMostTurn) << "face " << f;
    }
  }
}

}  // namespace
}  // namespace organbake
