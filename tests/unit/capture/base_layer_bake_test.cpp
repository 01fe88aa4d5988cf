// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "organbake/geometry/lattice.h"
#include "organbake/geometry/shell_map.h"
#include "unit/capture/scenes.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

struct Node {
  std::uint32_t face;
  std::size_t index;
  Vector3d point;
};

std::vector<Node> nodes_of(const BaseLayer& base, const TriangleMesh& proxy) {
  const std::vector<Vector3d> normals = vertex_normals(proxy);
  std::vector<Node> nodes;
  for (std::uint32_t f = 0; f < base.face_count; ++f) {
    const ShellMatrix shell = shell_matrix(proxy, normals, f);
    for (std::uint32_t i = 0; i <= base.steps; ++i)
      for (std::uint32_t j = 0; i + j <= base.steps; ++j) {
        const std::size_t index =
            std::size_t(f) * base.nodes_per_face() + base_node_index(base.steps, i, j);
        const double b1 = double(i) / base.steps, b2 = double(j) / base.steps;
        nodes.push_back({f, index, shell_point(shell, b1, b2, base.height_mm[index])});
      }
  }
  return nodes;
}

struct Baked {
  TriangleMesh surface, proxy;
  std::vector<PosedCamera> cameras;
  BaseLayer base;
};

Baked bake(const TriangleMesh& surface, const TriangleMesh& proxy) {
  Baked baked{
      surface,
      proxy,
      {plain_camera({0, -160, 0}, {0, 0, 0}, 200), plain_camera({0, 160, 0}, {0, 0, 0}, 200)},
      {}};
  CaptureOptions options;
  options.base_step_mm = 3;
  baked.base = capture(surface, proxy, baked.cameras, *make_material_color({}), options).base;
  return baked;
}

TEST(BaseLayer, NodesLieOnTheSurface) {
  const Baked baked = bake(lumpy_mesh(40, 5), lumpy_mesh(40, 1));
  EXPECT_EQ(baked.base.face_count, 80u);
  EXPECT_GT(baked.base.steps, 4u);
  const RayScene scene(baked.surface);
  for (const Node& node : nodes_of(baked.base, baked.proxy))
    EXPECT_LT(scene.closest_point(node.point).distance_mm, 1e-4);  // heights are floats
}

TEST(BaseLayer, SharedNodesAreIdentical) {
  const Baked baked = bake(lumpy_mesh(40, 5), lumpy_mesh(40, 1));
  const BaseLayer& base = baked.base;
  const Lattice lattice(baked.proxy, base.steps);
  std::map<std::uint32_t, std::size_t> first;
  std::size_t shared = 0;
  for (std::uint32_t f = 0; f < base.face_count; ++f)
    for (std::uint32_t i = 0; i <= base.steps; ++i)
      for (std::uint32_t j = 0; i + j <= base.steps; ++j) {
        const std::size_t index =
            std::size_t(f) * base.nodes_per_face() + base_node_index(base.steps, i, j);
        const auto [known, is_new] = first.try_emplace(lattice.node(f, i, j), index);
        if (is_new) continue;
        ++shared;
        EXPECT_EQ(base.height_mm[index], base.height_mm[known->second]);
        EXPECT_EQ(base.color[index], base.color[known->second]);
        EXPECT_EQ(base.seen_by[index], base.seen_by[known->second]);
      }
  EXPECT_GT(shared, 80u * 3 * base.steps / 2);
}

TEST(BaseLayer, KnowsWhoSeesIt) {
  const Baked baked = bake(sphere_mesh(40, 5), sphere_mesh(40, 1));
  int front = 0, both = 0;
  for (const Node& node : nodes_of(baked.base, baked.proxy)) {
    const std::uint32_t seen = baked.base.seen_by[node.index];
    EXPECT_LT(seen, 4u) << "there are two cameras";
    const double facing = -node.point.normalized().y();
    if (facing > 0.75) {
      EXPECT_EQ(seen, 1u);
    }
    if (facing < -0.75) {
      EXPECT_EQ(seen, 2u);
    }
    if (std::abs(facing) < 0.2) {
      EXPECT_EQ(seen, 0u) << "too steep for either";
    }
    front += seen & 1;
    both += seen == 3;
  }
  EXPECT_GT(front, 100);
  EXPECT_EQ(both, 0);
}

// The surface passes through the proxy's very vertices: heights are zero, not the far wall's.
TEST(BaseLayer, AProxyThatIsTheSurfaceHasHeightZero) {
  const TriangleMesh mesh = lumpy_mesh(40, 2);
  const Baked baked = bake(mesh, mesh);
  for (const float height : baked.base.height_mm) EXPECT_NEAR(height, 0, 1e-4);
}

// Nodes over a missing half of the surface find nothing on their lines.
TEST(BaseLayer, NodesWithoutASurfaceTakeTheNearest) {
  TriangleMesh half = sphere_mesh(40, 4);
  std::erase_if(half.faces, [&](const Face& f) { return half.vertices[f[0]].y() > 0; });
  const Baked baked = bake(half, sphere_mesh(38, 1));
  for (std::size_t i = 0; i < baked.base.height_mm.size(); ++i) {
    EXPECT_TRUE(std::isfinite(baked.base.height_mm[i]));
    EXPECT_LT(std::abs(baked.base.height_mm[i]), 80);
    EXPECT_TRUE(baked.base.color[i].allFinite());
    EXPECT_GT(baked.base.color[i].maxCoeff(), 0);
  }
}

}  // namespace
}  // namespace organbake
