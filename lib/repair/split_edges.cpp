// SPDX-License-Identifier: GPL-3.0-or-later
#include "repair/repair_steps.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "core/union_find.h"

namespace organbake {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFu;

// A face at an edge from its lower vertex to its higher one; corners are 3·face + corner.
struct CornerUse {
  std::uint64_t edge;
  std::uint32_t low_corner, high_corner;
  bool up;  // the face runs from low to high
  double angle = 0;
};

std::vector<CornerUse> sorted_corner_uses(const std::vector<Face>& faces) {
  std::vector<CornerUse> uses;
  uses.reserve(3 * faces.size());
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    for (std::uint32_t c = 0; c < 3; ++c) {
      std::uint32_t low = 3 * f + c, high = 3 * f + (c + 1) % 3;
      std::uint64_t a = faces[f][c], b = faces[f][(c + 1) % 3];
      const bool up = a < b;
      if (!up) {
        std::swap(a, b);
        std::swap(low, high);
      }
      uses.push_back({a << 32 | b, low, high, up});
    }
  }
  std::sort(uses.begin(), uses.end(), [](const CornerUse& a, const CornerUse& b) {
    return a.edge != b.edge ? a.edge < b.edge : a.low_corner < b.low_corner;
  });
  return uses;
}

// Corners that share a vertex and hang together through edges at it.
class Fans {
 public:
  explicit Fans(std::size_t faces) : corners_(3 * faces) {}
  std::uint32_t find(std::uint32_t corner) { return corners_.root(corner); }
  void join(const CornerUse& a, const CornerUse& b) {
    corners_.join(a.low_corner, b.low_corner);
    corners_.join(a.high_corner, b.high_corner);
  }

 private:
  UnionFind corners_;
};

// Round the edge, counter-clockwise seen from its higher vertex: outside lies ahead of a face that
// runs up, behind one that runs down. A solid lies from one that runs down to the next that runs
// up.
void join_solids(const TriangleMesh& mesh, std::span<CornerUse> uses, Fans& fans) {
  const auto corner = [&](std::uint32_t c) { return mesh.vertices[mesh.faces[c / 3][c % 3]]; };
  const Eigen::Vector3d low = corner(uses[0].low_corner), high = corner(uses[0].high_corner);
  const Eigen::Vector3d along = (high - low).normalized();
  const Eigen::Vector3d x = along.unitOrthogonal(), y = along.cross(x);
  for (CornerUse& use : uses) {
    const std::uint32_t face = use.low_corner / 3;
    const std::uint32_t third = 3 * face + (3 - use.low_corner % 3 - use.high_corner % 3);
    const Eigen::Vector3d out = corner(third) - low;
    use.angle = std::atan2(out.dot(y), out.dot(x));
  }
  std::stable_sort(uses.begin(), uses.end(),
                   [](const CornerUse& a, const CornerUse& b) { return a.angle < b.angle; });
  for (std::size_t i = 0; i < uses.size(); ++i) {
    const CornerUse &from = uses[i], &to = uses[(i + 1) % uses.size()];
    if (!from.up && to.up) fans.join(from, to);
  }
}

}  // namespace

std::size_t split_edges(TriangleMesh& mesh) {
  std::vector<CornerUse> uses = sorted_corner_uses(mesh.faces);
  Fans fans(mesh.faces.size());
  for (std::size_t i = 0; i < uses.size();) {
    const std::size_t begin = i;
    while (i < uses.size() && uses[i].edge == uses[begin].edge) ++i;
    if (i - begin == 2) fans.join(uses[begin], uses[begin + 1]);
    if (i - begin > 2) join_solids(mesh, std::span(uses).subspan(begin, i - begin), fans);
  }
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
