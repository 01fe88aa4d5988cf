// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/mesh_edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>

#include "support/meshes.h"

namespace organbake {
namespace {

using Edge = std::pair<std::uint32_t, std::uint32_t>;

// Faces and directions at each edge, as one would write them down by hand.
std::map<Edge, std::vector<std::pair<std::uint32_t, bool>>> by_hand(const TriangleMesh& mesh) {
  std::map<Edge, std::vector<std::pair<std::uint32_t, bool>>> uses;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const auto& [a, b, c] = mesh.faces[f];
    for (const auto& [from, to] : {Edge(a, b), Edge(b, c), Edge(c, a)})
      if (from != to) uses[std::minmax(from, to)].emplace_back(f, from < to);
  }
  return uses;
}

// A closed mesh, an open one, three sheets at one edge, a face with a repeated corner.
TriangleMesh awkward_mesh() {
  TriangleMesh mesh = sphere_mesh(1, 1);
  mesh.faces.resize(mesh.faces.size() / 2);
  const Face first = mesh.faces[0];
  mesh.faces.push_back({first[0], first[1], static_cast<std::uint32_t>(mesh.vertices.size() - 1)});
  mesh.faces.push_back({first[0], first[0], first[2]});
  return mesh;
}

TEST(MeshEdges, AreVisitedInOrderWithAllFacesThatUseThem) {
  for (const TriangleMesh& mesh : {sphere_mesh(1, 2), awkward_mesh()}) {
    const auto expected = by_hand(mesh);
    auto next = expected.begin();
    std::size_t visited = 0;
    MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
      ASSERT_NE(next, expected.end());
      EXPECT_EQ(Edge(uses[0].low, uses[0].high), next->first);
      ASSERT_EQ(uses.size(), next->second.size());
      for (std::size_t i = 0; i < uses.size(); ++i) {
        EXPECT_EQ(uses[i].face(), next->second[i].first);
        EXPECT_EQ(uses[i].up(), next->second[i].second);
      }
      visited += uses.size();
      ++next;
    });
    EXPECT_EQ(next, expected.end());
    EXPECT_EQ(MeshEdges(mesh).use_count(), visited);
  }
}

TEST(MeshEdges, TellTheCornersOfEachFace) {
  const TriangleMesh mesh = awkward_mesh();
  const auto vertex = [&](std::uint32_t corner) { return mesh.faces[corner / 3][corner % 3]; };
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    for (const EdgeUse& use : uses) {
      EXPECT_EQ(vertex(use.low_corner), use.low);
      EXPECT_EQ(vertex(use.high_corner), use.high);
      EXPECT_EQ(vertex(use.half_edge()), use.up() ? use.low : use.high);
      const std::uint32_t corners = use.low_corner + use.high_corner + use.opposite_corner();
      EXPECT_EQ(corners, 9 * use.face() + 3);  // all three of the face
    }
  });
}

TEST(MeshEdges, OfNoFacesAreNone) {
  TriangleMesh mesh = sphere_mesh(1, 1);
  mesh.faces.clear();
  EXPECT_EQ(MeshEdges(mesh).use_count(), 0u);
  EXPECT_EQ(MeshEdges(std::vector<Face>{}, 0).use_count(), 0u);
}

TEST(HalfEdgeTwins, AreAcrossEdgesOfTwoFaces) {
  const TriangleMesh mesh = awkward_mesh();
  const std::vector<std::uint32_t> twins = half_edge_twins(mesh);
  const auto uses = by_hand(mesh);
  for (std::uint32_t h = 0; h < twins.size(); ++h) {
    const std::uint32_t n = next_in_face(h);
    const auto a = mesh.faces[h / 3][h % 3], b = mesh.faces[n / 3][n % 3];
    if (a == b || uses.at(std::minmax(a, b)).size() != 2) {
      EXPECT_EQ(twins[h], kNoHalfEdge);
    } else {
      EXPECT_EQ(twins[twins[h]], h);
    }
  }
}

TEST(ManifoldTwins, ExistForManifoldsOnly) {
  TriangleMesh mesh = tetrahedron_mesh();
  const auto twins = manifold_twins(mesh);
  ASSERT_TRUE(twins);
  for (std::uint32_t h = 0; h < 12; ++h) EXPECT_EQ((*twins)[(*twins)[h]], h);
  std::swap(mesh.faces[0][0], mesh.faces[0][1]);
  EXPECT_FALSE(manifold_twins(mesh));  // wound against its neighbours
  // Two bodies that share a vertex.
  mesh = joined(tetrahedron_mesh(), moved(tetrahedron_mesh(), {5, 0, 0}));
  for (Face& f : mesh.faces) {
    for (std::uint32_t& v : f) v = v == 4 ? 0 : v;
  }
  EXPECT_FALSE(manifold_twins(mesh));
  mesh = tetrahedron_mesh();
  mesh.faces.push_back({0, 1, 3});
  EXPECT_FALSE(manifold_twins(mesh));
  mesh = tetrahedron_mesh();
  mesh.faces.push_back({0, 1, 1});  // a repeated corner
  EXPECT_FALSE(manifold_twins(mesh));
  mesh = tetrahedron_mesh();
  mesh.faces.pop_back();  // open, and still a manifold
  const auto open = manifold_twins(mesh);
  ASSERT_TRUE(open);
  EXPECT_EQ(std::count(open->begin(), open->end(), kNoHalfEdge), 3);
}

}  // namespace
}  // namespace organbake
