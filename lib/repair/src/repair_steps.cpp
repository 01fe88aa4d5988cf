// SPDX-License-Identifier: GPL-3.0-or-later
// Steps that change how a surface hangs together and leave its shape alone: slits at T-junctions,
// edges and vertices of several sheets, holes. Holes are filled by the triangulation of least area
// and bending (Liepa 2003; CGAL).
#include "repair_steps.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/utility.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "organbake/decimate/mesh_measures.h"

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

// Round the edge, counter-clockwise seen from its higher vertex: outside lies ahead of a face that
// runs up, behind one that runs down. A solid lies from one that runs down to the next that runs
// up.
void join_solids(const TriangleMesh& mesh, std::span<const EdgeUse> uses, UnionFind& fans) {
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
    if (!from.up() && to.up()) join_fans(from, to, fans);
  }
}

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Loop = std::vector<std::uint32_t>;

// The rims of holes, each in the order in which faces that close it would wind.
std::vector<Loop> open_loops(const TriangleMesh& mesh) {
  std::map<std::uint32_t, std::uint32_t> next;  // against the faces' direction
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    const auto up = std::count_if(uses.begin(), uses.end(), [](auto& use) { return use.up(); });
    if (up == 0) next[uses[0].low] = uses[0].high;
    if (up == std::ssize(uses)) next[uses[0].high] = uses[0].low;
  });
  std::vector<Loop> loops;
  while (!next.empty()) {
    Loop& loop = loops.emplace_back();
    for (auto at = next.begin(); at != next.end();) {
      loop.push_back(at->first);
      const std::uint32_t following = at->second;
      next.erase(at);
      at = next.find(following);
    }
  }
  return loops;
}

// Whether two points of the rim lie further apart than this.
bool is_wider(const TriangleMesh& mesh, const Loop& loop, double largest_mm) {
  Bounds box;
  for (const std::uint32_t v : loop) box.add(mesh.vertices[v]);
  if (box.diagonal() <= largest_mm) return false;
  if ((box.max - box.min).maxCoeff() > largest_mm) return true;
  for (std::size_t i = 0; i < loop.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if ((mesh.vertices[loop[i]] - mesh.vertices[loop[j]]).norm() > largest_mm) return true;
  return false;
}

bool close_loop(TriangleMesh& mesh, const Loop& loop) {
  if (loop.size() < 3) return false;
  if (loop.size() == 3) {  // there is but one way, even where the three lie on a line
    mesh.faces.push_back({loop[0], loop[1], loop[2]});
    return true;
  }
  std::vector<Kernel::Point_3> rim;
  for (const std::uint32_t v : loop) {
    rim.emplace_back(mesh.vertices[v].x(), mesh.vertices[v].y(), mesh.vertices[v].z());
  }
  std::vector<CGAL::Triple<int, int, int>> patch;
  CGAL::Polygon_mesh_processing::triangulate_hole_polyline(rim, std::back_inserter(patch));
  for (const auto& triangle : patch) {
    mesh.faces.push_back({loop[static_cast<std::size_t>(triangle.first)],
                          loop[static_cast<std::size_t>(triangle.second)],
                          loop[static_cast<std::size_t>(triangle.third)]});
  }
  return !patch.empty();
}

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

std::size_t split_edges(TriangleMesh& mesh) {
  UnionFind fans(3 * mesh.faces.size());
  MeshEdges(mesh).for_each([&](std::span<const EdgeUse> uses) {
    if (uses.size() == 2) join_fans(uses[0], uses[1], fans);
    if (uses.size() > 2) join_solids(mesh, uses, fans);
  });
  TriangleMesh parted = split_fans(mesh, fans);
  std::vector<bool> used(mesh.vertices.size(), false);
  for (const Face& face : mesh.faces)
    for (const std::uint32_t v : face) used[v] = true;
  const std::size_t added =
      parted.vertices.size() - static_cast<std::size_t>(std::count(used.begin(), used.end(), true));
  // Else its vertices keep their order.
  const bool all_used = parted.vertices.size() == mesh.vertices.size();
  if (added > 0 || !all_used) mesh = std::move(parted);
  return added;
}

ClosedHoles close_holes(TriangleMesh& mesh, double largest_mm) {
  ClosedHoles holes;
  for (const Loop& loop : open_loops(mesh)) {
    const bool closed = !is_wider(mesh, loop, largest_mm) && close_loop(mesh, loop);
    ++(closed ? holes.closed : holes.left);
  }
  return holes;
}

}  // namespace organbake
