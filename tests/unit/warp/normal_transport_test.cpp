// SPDX-License-Identifier: Apache-2.0
#include "light/normal_transport.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "support/synthetic_bundle.h"

namespace organbake {
namespace {

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
