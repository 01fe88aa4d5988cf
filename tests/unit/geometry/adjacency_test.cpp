// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/adjacency.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "support/meshes.h"

namespace organbake {
namespace {

TEST(VertexFaces, ListsEveryUseInOrder) {
  const TriangleMesh mesh = sphere_mesh(1, 1);
  const VertexFaces around(mesh.faces, mesh.vertices.size());
  std::size_t uses = 0;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    const auto faces = around.of(v);
    uses += faces.size();
    EXPECT_TRUE(std::is_sorted(faces.begin(), faces.end()));
    for (const std::uint32_t f : faces) {
      EXPECT_NE(std::find(mesh.faces[f].begin(), mesh.faces[f].end(), v), mesh.faces[f].end());
    }
  }
  EXPECT_EQ(uses, 3 * mesh.faces.size());
}

// Of an open mesh as well, where an edge has one face.
TEST(VertexNeighbours, AreTheOtherEndsOfItsEdgesOnceInOrder) {
  TriangleMesh mesh = sphere_mesh(1, 1);
  mesh.faces.resize(mesh.faces.size() / 2);
  const VertexNeighbours neighbours(mesh.faces, mesh.vertices.size());
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    std::set<std::uint32_t> expected;
    for (const Face& f : mesh.faces) {
      if (std::find(f.begin(), f.end(), v) != f.end()) expected.insert(f.begin(), f.end());
    }
    expected.erase(v);
    const auto around = neighbours.of(v);
    EXPECT_TRUE(std::equal(around.begin(), around.end(), expected.begin(), expected.end()));
  }
}

}  // namespace
}  // namespace organbake
