// SPDX-License-Identifier: GPL-3.0-or-later
#include "finer_surface.h"

#include <span>
#include <vector>

#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/refine.h"

namespace organbake {
namespace {

struct Neighbours {
  std::vector<Eigen::Vector3d> sum;
  std::vector<int> count;
};

Neighbours sums_of(const TriangleMesh& mesh) {
  Neighbours all{std::vector<Eigen::Vector3d>(mesh.vertices.size(), Eigen::Vector3d::Zero()),
                 std::vector<int>(mesh.vertices.size(), 0)};
  for (const Face& face : mesh.faces)
    for (int i = 0; i < 3; ++i) {
      all.sum[face[i]] += mesh.vertices[face[(i + 1) % 3]] + mesh.vertices[face[(i + 2) % 3]];
      all.count[face[i]] += 2;
    }
  return all;
}

std::vector<bool> on_border(const TriangleMesh& mesh) {
  std::vector<bool> border(mesh.vertices.size(), false);
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() == 1) border[uses[0].low] = border[uses[0].high] = true;
  });
  return border;
}

}  // namespace

// Rounds of shrinking and growing alike (Taubin 1995) take the corners that split faces leave, and
// keep the size.
TriangleMesh finer_surface(const TriangleMesh& coarse, double longest_mm) {
  TriangleMesh mesh = refine_edges(coarse, longest_mm).mesh;
  const std::vector<bool> border = on_border(mesh);
  constexpr int kRounds = 8;
  constexpr double kShrink = 0.5, kGrow = -0.53;
  for (int round = 0; round < kRounds; ++round)
    for (const double step : {kShrink, kGrow}) {
      const Neighbours around = sums_of(mesh);
      for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        if (!border[v] && around.count[v] > 0)
          mesh.vertices[v] += step * (around.sum[v] / around.count[v] - mesh.vertices[v]);
    }
  return mesh;
}

}  // namespace organbake
