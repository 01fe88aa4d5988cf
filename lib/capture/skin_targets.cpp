// SPDX-License-Identifier: GPL-3.0-or-later
#include "capture/skin_targets.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "capture/shell_hits.h"
#include "geometry/smooth_skin.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// Halves of a node's value come from its neighbours: bumps of a face or two of the skin fade.
constexpr int kHeightPasses = 2;
// A face that leans farther against its proxy's face is taken for folded.
constexpr double kFoldedCosine = 0.1;
constexpr int kMostUnfoldings = 12;

// The neighbours of each node along the skin's edges.
class NodeGraph {
 public:
  NodeGraph(std::size_t nodes, const std::vector<Face>& faces) : start_(nodes + 1, 0) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const Face& f : faces) {
      for (int k = 0; k < 3; ++k) {
        edges.emplace_back(f[k], f[(k + 1) % 3]);
        edges.emplace_back(f[(k + 1) % 3], f[k]);
      }
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    for (const auto& [from, to] : edges) ++start_[from + 1], to_.push_back(to);
    for (std::size_t n = 0; n < nodes; ++n) start_[n + 1] += start_[n];
  }

  // Each value half its own, half its neighbours' mean.
  template <class Value>
  void smooth(std::vector<Value>& values, int passes) const {
    for (int pass = 0; pass < passes; ++pass) {
      std::vector<Value> next = values;
      for (std::size_t n = 0; n < values.size(); ++n) {
        if (start_[n] == start_[n + 1]) continue;
        next[n] = 0.5 * values[n] + 0.5 * neighbours_mean(values, n);
      }
      values = std::move(next);
    }
  }
  template <class Value>
  Value neighbours_mean(const std::vector<Value>& values, std::size_t n) const {
    Value sum = 0 * values[n];
    for (std::uint32_t k = start_[n]; k < start_[n + 1]; ++k) sum += values[to_[k]];
    return sum / double(start_[n + 1] - start_[n]);
  }

 private:
  std::vector<std::uint32_t> start_, to_;
};

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
  const NodeGraph graph(lines.size(), skin.faces);
  graph.smooth(heights, kHeightPasses);
  skin.vertices = lifted(lines, heights);
  unfold(proxy, lines, skin, heights);

  // A random walk of k passes goes about √(k/2) edges far: half an edge of the proxy.
  const int passes =
      static_cast<int>(std::min(32u, std::max(1u, lattice.steps() * lattice.steps() / 2)));
  std::vector<Vector3d> smooth = vertex_normals(skin);
  graph.smooth(smooth, passes);
  std::vector<SkinTarget> targets(lines.size());
  for (std::size_t n = 0; n < targets.size(); ++n) {
    const double length = smooth[n].norm();
    targets[n] = {skin.vertices[n], length > 0 ? Vector3d(smooth[n] / length) : Vector3d::UnitZ()};
  }
  return targets;
}

}  // namespace organbake
