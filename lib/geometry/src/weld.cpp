// SPDX-License-Identifier: Apache-2.0
// Vertices that files keep once for each face become one again. Candidates are found by sorting
// along a slant direction, so that neighbours in space are neighbours in the list; only vertices of
// open edges are looked at, which keeps bodies that touch apart.
#include "organbake/geometry/weld.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

constexpr double kNearShare = 1e-6;  // of the size: what single precision leaves of a place

std::vector<std::uint32_t> open_vertices(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> vertices;
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() == 1) vertices.insert(vertices.end(), {uses[0].low, uses[0].high});
  });
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  return vertices;
}

// Which vertex each becomes: the lowest of those within the tolerance (0 = at the same place).
std::vector<std::uint32_t> targets(const TriangleMesh& mesh, double tolerance_mm) {
  std::vector<std::uint32_t> target(mesh.vertices.size());
  std::iota(target.begin(), target.end(), 0u);
  std::vector<std::uint32_t> open = open_vertices(mesh);
  // Along a slant direction even a voxel box has hardly two corners side by side.
  const Eigen::Vector3d slant = Eigen::Vector3d(0.5377, 0.6131, 0.5788).normalized();
  // Worked out once: a product that is fused in one place and not in another differs from itself,
  // and an order of such numbers is none.
  std::vector<double> along;
  along.reserve(mesh.vertices.size());
  for (const Eigen::Vector3d& vertex : mesh.vertices) along.push_back(vertex.dot(slant));
  std::sort(open.begin(), open.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(along[a], a) < std::pair(along[b], b);
  });
  for (std::size_t i = 0; i < open.size(); ++i) {
    const Eigen::Vector3d& place = mesh.vertices[open[i]];
    if (target[open[i]] != open[i]) continue;
    for (std::size_t j = i + 1; j < open.size(); ++j) {
      const Eigen::Vector3d& other = mesh.vertices[open[j]];
      if (along[open[j]] - along[open[i]] > tolerance_mm) break;
      if (target[open[j]] != open[j]) continue;
      if ((other - place).norm() <= tolerance_mm) target[open[j]] = open[i];
    }
  }
  return target;
}

TriangleMesh merged(const TriangleMesh& mesh, const std::vector<std::uint32_t>& target) {
  TriangleMesh result;
  std::vector<Eigen::Vector3f> color_sum(mesh.colors.size(), Eigen::Vector3f::Zero());
  std::vector<float> count(mesh.vertices.size(), 0.0f);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    ++count[target[v]];
    if (!mesh.colors.empty()) color_sum[target[v]] += mesh.colors[v];
  }
  std::vector<std::uint32_t> number(mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (target[v] != v) continue;
    number[v] = static_cast<std::uint32_t>(result.vertices.size());
    result.vertices.push_back(mesh.vertices[v]);
    if (!mesh.colors.empty())
      result.colors.push_back(count[v] == 1 ? mesh.colors[v]
                                            : Eigen::Vector3f(color_sum[v] / count[v]));
  }
  for (Face face : mesh.faces) {
    for (std::uint32_t& v : face) v = number[target[v]];
    // Slivers that closed up are gone, and with them faces that had a repeated corner before.
    if (face[0] != face[1] && face[1] != face[2] && face[2] != face[0])
      result.faces.push_back(face);
  }
  return result;
}

std::size_t weld_within(TriangleMesh& mesh, double tolerance_mm) {
  TriangleMesh welded = merged(mesh, targets(mesh, tolerance_mm));
  const std::size_t gone = mesh.vertices.size() - welded.vertices.size();
  if (gone > 0) mesh = std::move(welded);
  return gone;
}

struct EdgeCounts {
  std::size_t open = 0, crowded = 0;  // used by one face, by three or more
};
EdgeCounts count_edges(const TriangleMesh& mesh) {
  EdgeCounts counts;
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    counts.open += uses.size() == 1;
    counts.crowded += uses.size() > 2;
  });
  return counts;
}

}  // namespace

WeldSummary weld(TriangleMesh& mesh) {
  WeldSummary summary;
  if (count_edges(mesh).open == 0) return summary;
  summary.exact = weld_within(mesh, 0);
  const EdgeCounts exact = count_edges(mesh);
  if (exact.open == 0) return summary;
  TriangleMesh close = mesh;
  const double tolerance_mm = kNearShare * bounds(mesh).diagonal();
  const std::size_t gone = weld_within(close, tolerance_mm);
  if (gone == 0) return summary;
  const EdgeCounts after = count_edges(close);
  if (after.open >= exact.open || after.crowded > exact.crowded) return summary;
  summary.near = gone;
  summary.tolerance_mm = tolerance_mm;
  mesh = std::move(close);
  return summary;
}

}  // namespace organbake
