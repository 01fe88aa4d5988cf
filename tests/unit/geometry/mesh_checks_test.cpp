// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/mesh_checks.h"

#include <gtest/gtest.h>

#include <limits>

#include "organbake/core/error.h"
#include "support/meshes.h"

namespace organbake {
namespace {

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
