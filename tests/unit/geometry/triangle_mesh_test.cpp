// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/triangle_mesh.h"

#include "organbake/core/error.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {
namespace {

TEST(TriangleMesh, KnowsVolumeAreaAndBounds) {
  const TriangleMesh box = box_mesh({2, 3, 4});
  EXPECT_NEAR(signed_volume(box), 24, 1e-12);
  EXPECT_NEAR(surface_area(box), 52, 1e-12);
  EXPECT_EQ(bounds(box).max, Eigen::Vector3d(2, 3, 4));
  EXPECT_NEAR(signed_volume(tetrahedron_mesh()), 1.0 / 6, 1e-15);
}

TEST(TriangleMesh, VolumeKeepsItsDigitsFarFromTheOrigin) {
  TriangleMesh box = box_mesh({2, 3, 4});
  for (auto& v : box.vertices) v += Eigen::Vector3d::Constant(1e6);
  EXPECT_NEAR(signed_volume(box), 24, 1e-6);
}

TEST(VertexNormals, PointOutwardOnASphere) {
  const TriangleMesh sphere = sphere_mesh(10, 4);
  const auto normals = vertex_normals(sphere);
  constexpr double kTolerance = 4e-3;  // rad; the faceting of 5,120 faces gives 2.6e-3
  for (std::size_t v = 0; v < normals.size(); ++v)
    EXPECT_LT((normals[v] - sphere.vertices[v] / 10).norm(), kTolerance);
}

TEST(VertexNormals, DoNotDependOnHowASquareIsCut) {
  // The angle weights of the two triangulations of a box's sides add up to the same.
  for (const auto& n : vertex_normals(box_mesh({1, 1, 1})))
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(std::abs(n[k]), 1 / std::numbers::sqrt3, 1e-12);
}

TEST(VertexNormals, AreUnitEvenWithoutFaces) {
  TriangleMesh lone;
  lone.vertices = {{1, 2, 3}};
  EXPECT_EQ(vertex_normals(lone)[0], Eigen::Vector3d::UnitZ());
}

// Of an open mesh as well, where an edge has one face.
TEST(VertexNeighbours, AreTheOtherEndsOfItsEdgesOnceInOrder) {
  TriangleMesh mesh = sphere_mesh(1, 1);
  mesh.faces.resize(mesh.faces.size() / 2);
  const VertexNeighbours neighbours(mesh.faces, mesh.vertices.size());
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    std::set<std::uint32_t> expected;
    for (const Face& f : mesh.faces)
      if (std::find(f.begin(), f.end(), v) != f.end()) expected.insert(f.begin(), f.end());
    expected.erase(v);
    const auto around = neighbours.of(v);
    EXPECT_TRUE(std::equal(around.begin(), around.end(), expected.begin(), expected.end()));
  }
}

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
  for (Face& f : mesh.faces)
    for (std::uint32_t& v : f) v = v == 4 ? 0 : v;
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

TEST(Topology, OfASphere) {
  const MeshTopology t = analyse_topology(sphere_mesh(1, 2));
  EXPECT_TRUE(t.closed_manifold());
  EXPECT_EQ(t.euler_characteristic, 2);
  EXPECT_EQ(t.components, 1u);
  EXPECT_EQ(t.degenerate_faces, 0u);
}

TEST(Topology, FindsEachDefect) {
  TriangleMesh open = box_mesh({1, 1, 1});
  open.faces.pop_back();
  EXPECT_EQ(analyse_topology(open).boundary_edges, 3u);
  EXPECT_EQ(analyse_topology(open).boundary_loops, 1u);
  EXPECT_EQ(analyse_topology(box_mesh({1, 1, 1})).boundary_loops, 0u);
  TriangleMesh two_holes = sphere_mesh(1, 2);
  std::swap(two_holes.faces[7], two_holes.faces.back());
  two_holes.faces.pop_back();
  two_holes.faces.erase(two_holes.faces.begin() + 200);
  EXPECT_EQ(analyse_topology(two_holes).boundary_loops, 2u);

  TriangleMesh turned = box_mesh({1, 1, 1});
  std::swap(turned.faces[0][0], turned.faces[0][1]);
  EXPECT_EQ(analyse_topology(turned).misoriented_edges, 3u);

  TriangleMesh fin = box_mesh({1, 1, 1});
  fin.vertices.push_back({5, 5, 5});
  fin.faces.push_back({0, 1, 8});
  EXPECT_EQ(analyse_topology(fin).non_manifold_edges, 1u);

  TriangleMesh flat = box_mesh({1, 1, 1});
  flat.faces.push_back({0, 0, 1});
  EXPECT_EQ(analyse_topology(flat).degenerate_faces, 1u);
}

TEST(Topology, TwoCornersOnOneVertexAreNotManifold) {
  TriangleMesh touching = joined(tetrahedron_mesh(), tetrahedron_mesh());
  for (Face& f : touching.faces) {
    for (auto& v : f) v = v == 4 ? 0 : v;  // both apexes become one vertex
  }
  const MeshTopology t = analyse_topology(touching);
  EXPECT_EQ(t.non_manifold_vertices, 1u);
  EXPECT_EQ(t.unused_vertices, 1u);
  EXPECT_FALSE(t.closed_manifold());
}

TEST(LargestComponents, KeepsTheLargestByArea) {
  const TriangleMesh two = joined(box_mesh({1, 1, 1}), moved(sphere_mesh(5, 2), {20, 0, 0}));
  ASSERT_EQ(analyse_topology(two).components, 2u);
  const TriangleMesh one = largest_components(two, 1);
  EXPECT_EQ(one.faces.size(), 320u);
  EXPECT_EQ(analyse_topology(one).unused_vertices, 0u);
  EXPECT_GT(bounds(one).min.x(), 10);
  EXPECT_EQ(largest_components(two, 0).faces.size(), two.faces.size());
}

TEST(CheckMesh, NamesTheFirstDefect) {
  TriangleMesh m = tetrahedron_mesh();
  EXPECT_NO_THROW(check_mesh(m, "m"));
  m.faces[2][1] = 99;
  EXPECT_THROW(check_mesh(m, "m"), BadDataError);
  m = tetrahedron_mesh();
  m.vertices[1].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(check_mesh(m, "m"), BadDataError);
  m = tetrahedron_mesh();
  m.colors.resize(3);
  EXPECT_THROW(check_mesh(m, "m"), BadDataError);
}

}  // namespace
}  // namespace organbake
