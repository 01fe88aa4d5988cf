// SPDX-License-Identifier: GPL-3.0-or-later
#include "skin_targets.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "organbake/geometry/adjacency.h"
#include "organbake/geometry/smooth_skin.h"
#include "shell_hits.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// Halves of a node's value come from its neighbours: bumps of a face or two of the skin fade.
constexpr int kHeightPasses = 2;
// A face that leans farther against its proxy's face is taken for folded.
constexpr double kFoldedCosine = 0.1;
constexpr int kMostUnfoldings = 12;

// Each value half its own, half its neighbours' mean.
template <class Value>
void smooth(std::vector<Value>& values, const VertexNeighbours& neighbours, int passes) {
  for (int pass = 0; pass < passes; ++pass) {
    std::vector<Value> next = values;
    for (std::uint32_t n = 0; n < values.size(); ++n) {
      const auto around = neighbours.of(n);
      if (around.empty()) continue;
      Value sum = 0 * values[n];
      for (const std::uint32_t other : around) sum += values[other];
      next[n] = 0.5 * values[n] + 0.5 * (sum / double(around.size()));
    }
    values = std::move(next);
  }
}

std::vector<Vector3d> lifted(const std::vector<Lattice::ShellLine>& lines,
                             const std::vector<double>& heights) {
  std::vector<Vector3d> points(lines.size());
  for (std::size_t n = 0; n < lines.size(); ++n)
    points[n] = lines[n].foot + heights[n] * lines[n].direction;
  return points;
}

// Lowers the nodes of folded faces towards the proxy, which has none, until none is left.
void unfold(const TriangleMesh& proxy, const std::vector<Lattice::ShellLine>& lines,
            TriangleMesh& skin, std::vector<double>& heights) {
  const std::size_t cells = skin.faces.size() / std::max<std::size_t>(1, proxy.faces.size());
  for (int round = 0; round < kMostUnfoldings; ++round) {
    std::vector<char> folded(heights.size(), 0);
    bool any = false;
    for (std::size_t f = 0; f < skin.faces.size(); ++f) {
      if (!(face_normal(skin, f).dot(face_normal(proxy, f / cells)) < kFoldedCosine)) continue;
      for (const std::uint32_t n : skin.faces[f]) folded[n] = 1;
      any = true;
    }
    if (!any) return;
    for (std::size_t n = 0; n < heights.size(); ++n) {
      if (folded[n]) heights[n] *= 0.5;
    }
    skin.vertices = lifted(lines, heights);
  }
}

}  // namespace

std::vector<SkinTarget> skin_targets(const TriangleMesh& proxy, const Lattice& lattice,
                                     const RayScene& rays, const SmoothNormals& normals,
                                     double reach_mm, const RunContext& context) {
  const std::vector<Lattice::ShellLine> lines = lattice.shell_lines();
  std::vector<double> heights;
  heights.reserve(lines.size());
  for (const RayHit& hit : shell_hits(lines, rays, normals, reach_mm, context))
    heights.push_back(std::clamp(hit.t, -reach_mm, reach_mm));

  TriangleMesh skin;
  skin.faces = smooth_skin_faces(proxy, lattice.steps());
  const VertexNeighbours neighbours(skin.faces, lines.size());
  smooth(heights, neighbours, kHeightPasses);
  skin.vertices = lifted(lines, heights);
  unfold(proxy, lines, skin, heights);

  // A random walk of k passes goes about √(k/2) edges far: half an edge of the proxy.
  const int passes =
      static_cast<int>(std::min(32u, std::max(1u, lattice.steps() * lattice.steps() / 2)));
  std::vector<Vector3d> directions = vertex_normals(skin);
  smooth(directions, neighbours, passes);
  std::vector<SkinTarget> targets(lines.size());
  for (std::size_t n = 0; n < targets.size(); ++n) {
    const double length = directions[n].norm();
    targets[n] = {skin.vertices[n],
                  length > 0 ? Vector3d(directions[n] / length) : Vector3d::UnitZ()};
  }
  return targets;
}

}  // namespace organbake
