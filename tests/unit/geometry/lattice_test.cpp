// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/lattice.h"

#include <gtest/gtest.h>

#include <set>

#include "support/meshes.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

class LatticeOfSteps : public ::testing::TestWithParam<std::uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Steps, LatticeOfSteps, ::testing::Values(1, 2, 3, 4, 7));

TEST_P(LatticeOfSteps, NodesLieWhereTheirFacesPutThem) {
  const TriangleMesh proxy = lumpy_mesh(20, 1);
  const std::vector<Vector3d> normals = vertex_normals(proxy);
  const std::uint32_t n = GetParam();
  const Lattice lattice(proxy, n);
  const auto lines = lattice.shell_lines();
  ASSERT_EQ(lines.size(), lattice.node_count());
  std::set<std::uint32_t> used;
  for (std::uint32_t f = 0; f < proxy.faces.size(); ++f)
    for (std::uint32_t i = 0; i <= n; ++i)
      for (std::uint32_t j = 0; i + j <= n; ++j) {
        const std::uint32_t node = lattice.node(f, i, j);
        ASSERT_LT(node, lines.size());
        used.insert(node);
        const double b1 = double(i) / n, b2 = double(j) / n;
        const Face& face = proxy.faces[f];
        const auto mixed = [&](const std::vector<Vector3d>& at) -> Vector3d {
          return (1 - b1 - b2) * at[face[0]] + b1 * at[face[1]] + b2 * at[face[2]];
        };
        EXPECT_LT((lines[node].foot - mixed(proxy.vertices)).norm(), 1e-12);
        EXPECT_LT((lines[node].direction - mixed(normals)).norm(), 1e-12);
      }
  EXPECT_EQ(used.size(), lines.size()) << "every node belongs to a face";
  // Euler: V + E (n − 1) + F (n − 1)(n − 2) / 2 on a closed surface.
  const std::size_t edges = proxy.faces.size() * 3 / 2;
  EXPECT_EQ(lines.size(),
            proxy.vertices.size() + edges * (n - 1) + proxy.faces.size() * ((n - 1) * (n - 2) / 2));
}

TEST(LatticeSteps, FollowTheEdgeLengthWithinBounds) {
  TriangleMesh proxy;  // edges of 30, 40 and 50 mm
  proxy.vertices = {{0, 0, 0}, {30, 0, 0}, {0, 40, 0}};
  proxy.faces = {{0, 1, 2}};
  EXPECT_EQ(lattice_steps(proxy, 2, 1000000), 20u);
  EXPECT_EQ(lattice_steps(proxy, 0.01, 1000000), 64u);
  EXPECT_EQ(lattice_steps(proxy, 1000, 1000000), 1u);
  EXPECT_EQ(lattice_steps(proxy, 2, 100), 12u);  // 13 · 14 / 2 = 91 nodes
  EXPECT_EQ(lattice_steps(proxy, 2, 1), 1u);
}

}  // namespace
}  // namespace organbake
