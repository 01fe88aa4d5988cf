// SPDX-License-Identifier: GPL-3.0-or-later
#include "repair_steps.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>
#include <vector>

#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

// Each by the one half-edge that runs along it.
std::vector<std::uint32_t> open_edges(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> open;
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() == 1) open.push_back(uses[0].half_edge());
  });
  return open;
}

// The ends of open edges, to be asked for by their x.
class VerticesByX {
 public:
  VerticesByX(const TriangleMesh& mesh, const std::vector<std::uint32_t>& edges) : mesh_(mesh) {
    for (const std::uint32_t h : edges)
      for (const std::uint32_t corner : {h, next_in_face(h)})
        vertices_.push_back(mesh.faces[corner / 3][corner % 3]);
    std::sort(vertices_.begin(), vertices_.end(), [&](std::uint32_t a, std::uint32_t b) {
      const double xa = mesh.vertices[a].x(), xb = mesh.vertices[b].x();
      return xa != xb ? xa < xb : a < b;
    });
    vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
  }

  // Those inside a–b, with their share of the way, in order; not the corners of its face.
  std::vector<std::pair<double, std::uint32_t>> on_edge(const Face& face, std::uint32_t corner,
                                                        double within_mm) const {
    const Eigen::Vector3d &a = mesh_.vertices[face[corner]],
                          &b = mesh_.vertices[face[(corner + 1) % 3]];
    const Eigen::Vector3d along = b - a;
    const double length = along.norm();
    std::vector<std::pair<double, std::uint32_t>> found;
    if (!(length > 2 * within_mm)) return found;
    const auto first =
        std::lower_bound(vertices_.begin(), vertices_.end(), std::min(a.x(), b.x()) - within_mm,
                         [&](std::uint32_t v, double x) { return mesh_.vertices[v].x() < x; });
    for (auto v = first; v != vertices_.end(); ++v) {
      const Eigen::Vector3d& p = mesh_.vertices[*v];
      if (p.x() > std::max(a.x(), b.x()) + within_mm) break;
      const double share = (p - a).dot(along) / (length * length);
      if (share * length <= within_mm || (1 - share) * length <= within_mm) continue;
      if (has_corner(face, *v) || (a + share * along - p).norm() > within_mm) continue;
      found.emplace_back(share, *v);
    }
    std::sort(found.begin(), found.end());
    return found;
  }

 private:
  const TriangleMesh& mesh_;
  std::vector<std::uint32_t> vertices_;
};

}  // namespace

std::size_t drop_slivers(TriangleMesh& mesh, double within_mm) {
  return std::erase_if(mesh.faces, [&](const Face& face) {
    const Eigen::Vector3d &a = mesh.vertices[face[0]], &b = mesh.vertices[face[1]],
                          &c = mesh.vertices[face[2]];
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    return (b - a).cross(c - a).norm() <= within_mm * longest;
  });
}

std::size_t cut_at_touching_vertices(TriangleMesh& mesh, double within_mm) {
  constexpr int kMostRounds = 4;  // a face has three edges, and its pieces may be cut again
  std::size_t cut = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    const std::vector<std::uint32_t> edges = open_edges(mesh);
    const VerticesByX vertices(mesh, edges);
    std::vector<bool> done(mesh.faces.size(), false);
    std::size_t now = 0;
    for (const std::uint32_t half_edge : edges) {
      const std::uint32_t f = half_edge / 3, corner = half_edge % 3;
      if (done[f]) continue;
      const Face face = mesh.faces[f];
      const auto on_edge = vertices.on_edge(face, corner, within_mm);
      if (on_edge.empty()) continue;
      const std::uint32_t apex = face[(corner + 2) % 3];
      std::uint32_t from = face[corner];
      for (std::size_t i = 0; i < on_edge.size(); ++i) {
        const Face piece = {from, on_edge[i].second, apex};
        if (i == 0) mesh.faces[f] = piece;
        if (i > 0) mesh.faces.push_back(piece);
        from = on_edge[i].second;
      }
      mesh.faces.push_back({from, face[(corner + 1) % 3], apex});
      done[f] = true;
      ++now;
    }
    cut += now;
    if (now == 0) break;
  }
  return cut;
}

}  // namespace organbake
