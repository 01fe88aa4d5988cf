// SPDX-License-Identifier: GPL-3.0-or-later
#include "repair_steps.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "organbake/core/union_find.h"
#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFu;

// Corners that share a vertex and hang together through edges at it.
class Fans {
 public:
  explicit Fans(std::size_t faces) : corners_(3 * faces) {}
  std::uint32_t find(std::uint32_t corner) { return corners_.root(corner); }
  void join(const EdgeUse& a, const EdgeUse& b) {
    corners_.join(a.low_corner, b.low_corner);
    corners_.join(a.high_corner, b.high_corner);
  }

 private:
  UnionFind corners_;
};

// Round the edge, counter-clockwise seen from its higher vertex: outside lies ahead of a face that
// runs up, behind one that runs down. A solid lies from one that runs down to the next that runs
// up.
void join_solids(const TriangleMesh& mesh, std::span<const EdgeUse> uses, Fans& fans) {
  const auto corner = [&](std::uint32_t c) { return mesh.vertices[mesh.faces[c / 3][c % 3]]; };
  const Eigen::Vector3d low = mesh.vertices[uses[0].low], high = mesh.vertices[uses[0].high];
  const Eigen::Vector3d along = (high - low).normalized();
  const Eigen::Vector3d x = along.unitOrthogonal(), y = along.cross(x);
  std::vector<std::pair<double, EdgeUse>> by_angle;
  for (const EdgeUse& use : uses) {
    const Eigen::Vector3d out = corner(use.opposite_corner()) - low;
    by_angle.emplace_back(std::atan2(out.dot(y), out.dot(x)), use);
  }
  std::stable_sort(by_angle.begin(), by_angle.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  for (std::size_t i = 0; i < by_angle.size(); ++i) {
    const EdgeUse &from = by_angle[i].second, &to = by_angle[(i + 1) % by_angle.size()].second;
    if (!from.up() && to.up()) fans.join(from, to);
  }
}

}  // namespace

std::size_t split_edges(TriangleMesh& mesh) {
  Fans fans(mesh.faces.size());
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() == 2) fans.join(uses[0], uses[1]);
    if (uses.size() > 2) join_solids(mesh, uses, fans);
  });
  TriangleMesh parted;
  std::vector<std::uint32_t> vertex_of_fan(3 * mesh.faces.size(), kNone);
  std::vector<bool> used(mesh.vertices.size(), false);
  std::size_t added = 0;
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    Face face;
    for (std::uint32_t c = 0; c < 3; ++c) {
      const std::uint32_t from = mesh.faces[f][c];
      std::uint32_t& vertex = vertex_of_fan[fans.find(3 * f + c)];
      if (vertex == kNone) {
        vertex = static_cast<std::uint32_t>(parted.vertices.size());
        parted.vertices.push_back(mesh.vertices[from]);
        if (!mesh.colors.empty()) parted.colors.push_back(mesh.colors[from]);
        added += used[from];
        used[from] = true;
      }
      face[c] = vertex;
    }
    parted.faces.push_back(face);
  }
  // Else its vertices keep their order.
  const bool all_used = parted.vertices.size() == mesh.vertices.size();
  if (added > 0 || !all_used) mesh = std::move(parted);
  return added;
}

}  // namespace organbake
