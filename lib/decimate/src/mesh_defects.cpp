// SPDX-License-Identifier: GPL-3.0-or-later
// Faces that meet other faces, by tests of segments against triangles on what CGAL's box
// intersection finds (Zomorodian & Edelsbrunner 2002); and surfaces made fit for a half-edge
// structure.
#include "organbake/decimate/mesh_measures.h"

#include <CGAL/Box_intersection_d/Box_with_info_d.h>
#include <CGAL/box_intersection_d.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <set>
#include <string>

#include "organbake/core/error.h"
#include "organbake/geometry/mesh_checks.h"

namespace organbake {
namespace {

using Box = Eigen::AlignedBox3d;
using Points = std::vector<Eigen::Vector3d>;

Box box_of(const Points& points, const Face& f) {
  Box box;
  for (const std::uint32_t v : f) box.extend(points[v]);
  return box;
}

double volume(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
              const Eigen::Vector3d& d) {
  return (b - a).dot((c - a).cross(d - a));
}

// Whether the segment pq passes through the inside or the rim of triangle f. Touching within a
// plane does not count: flat-sided bodies are full of it.
bool pierces(const Points& points, std::uint32_t p, std::uint32_t q, const Face& f) {
  const Eigen::Vector3d &a = points[f[0]], &b = points[f[1]], &c = points[f[2]];
  const double side_p = volume(points[p], a, b, c), side_q = volume(points[q], a, b, c);
  if (!((side_p > 0 && side_q < 0) || (side_p < 0 && side_q > 0))) return false;
  const double u = volume(points[p], points[q], a, b), v = volume(points[p], points[q], b, c),
               w = volume(points[p], points[q], c, a);
  return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
}

bool edges_pierce(const Points& points, const Face& of, const Face& through) {
  for (int c = 0; c < 3; ++c) {
    const std::uint32_t p = of[c], q = of[(c + 1) % 3];
    if (!has_corner(through, p) && !has_corner(through, q) && pierces(points, p, q, through))
      return true;
  }
  return false;
}

// Two faces over a common edge that look (nearly) against each other.
bool folded(const Points& points, const Face& f, const Face& g) {
  constexpr double kCosine = -0.9999;
  const auto normal = [&](const Face& t) -> Eigen::Vector3d {
    return (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]).normalized();
  };
  return normal(f).dot(normal(g)) < kCosine;
}

bool meet(const Points& points, const Face& f, const Face& g) {
  const int shared = has_corner(g, f[0]) + has_corner(g, f[1]) + has_corner(g, f[2]);
  if (shared == 3) return true;
  if (shared == 2) return folded(points, f, g);
  return edges_pierce(points, f, g) || edges_pierce(points, g, f);
}

using FaceBox = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::uint32_t>;

// A surface's faces have some dozens of others about them; where all of them lie upon one another
// the search would take the square of their number.
constexpr std::uint64_t kPairsPerFace = 100, kPairsOfAny = 50'000'000;
struct Enough {};

std::vector<FaceBox> boxes_of(const TriangleMesh& mesh) {
  std::vector<FaceBox> boxes;
  boxes.reserve(mesh.faces.size());
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    const Box box = box_of(mesh.vertices, mesh.faces[f]);
    boxes.emplace_back(CGAL::Bbox_3(box.min().x(), box.min().y(), box.min().z(), box.max().x(),
                                    box.max().y(), box.max().z()),
                       f);
  }
  return boxes;
}

// Calls look(f, g) for all pairs of faces whose boxes meet, until it says that it has seen enough.
// False where there are too many.
template <class Look>
bool search_pairs(const TriangleMesh& mesh, const Look& look) {
  std::vector<FaceBox> boxes = boxes_of(mesh);
  std::uint64_t left = kPairsOfAny + kPairsPerFace * mesh.faces.size();
  bool satisfied = false;
  const auto look_at = [&](const FaceBox& a, const FaceBox& b) {
    if (left-- == 0) throw Enough();
    satisfied = look(a.info(), b.info());
    if (satisfied) throw Enough();
  };
  try {
    CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), look_at);
  } catch (const Enough&) {
    return satisfied;
  }
  return true;
}

// The same three places in the same direction round.
bool lie_upon(const Points& points, const Face& f, const Face& g) {
  for (int shift = 0; shift < 3; ++shift) {
    if (points[f[0]] == points[g[shift]] && points[f[1]] == points[g[(shift + 1) % 3]] &&
        points[f[2]] == points[g[(shift + 2) % 3]])
      return true;
  }
  return false;
}

constexpr std::uint32_t kNoVertexYet = 0xFFFFFFFFu;

bool repeats_a_corner(const Face& f) { return f[0] == f[1] || f[1] == f[2] || f[2] == f[0]; }

void refuse_non_manifold_edges(const MeshTopology& topology) {
  if (topology.faces == 0) throw BadDataError("surface to decimate: it has no faces");
  if (topology.non_manifold_edges > 0) {
    throw BadDataError("surface to decimate: " + std::to_string(topology.non_manifold_edges) +
                       " edges belong to three or more faces; repair it to a manifold first");
  }
  if (topology.misoriented_edges > 0) {
    throw BadDataError("surface to decimate: neighbouring faces are wound against each other at " +
                       std::to_string(topology.misoriented_edges) +
                       " edges; orient its faces consistently first");
  }
}

// An open surface has no inside: its winding says which side is seen, whatever its "volume" is.
TriangleMesh outward(TriangleMesh mesh) {
  if (signed_volume(mesh) < 0 && analyse_topology(mesh).boundary_edges == 0) {
    for (Face& face : mesh.faces) std::swap(face[1], face[2]);
  }
  return mesh;
}

bool uses_all_vertices(const TriangleMesh& mesh) {
  std::vector<bool> used(mesh.vertices.size(), false);
  for (const Face& f : mesh.faces) {
    for (const std::uint32_t v : f) used[v] = true;
  }
  return std::find(used.begin(), used.end(), false) == used.end();
}

}  // namespace

bool faces_intersect(const std::vector<Eigen::Vector3d>& points, const std::vector<Face>& some,
                     const std::vector<Face>& others) {
  std::vector<Box> boxes;
  Box all;
  for (const Face& f : some) {
    boxes.push_back(box_of(points, f));
    all.extend(boxes.back());
  }
  const auto meets_after = [&](const Face& g, std::size_t from) {
    const Box box = box_of(points, g);
    if (!box.intersects(all)) return false;
    for (std::size_t i = from; i < some.size(); ++i) {
      if (boxes[i].intersects(box) && meet(points, some[i], g)) return true;
    }
    return false;
  };
  for (std::size_t i = 0; i < some.size(); ++i) {
    if (meets_after(some[i], i + 1)) return true;
  }
  return std::any_of(others.begin(), others.end(),
                     [&](const Face& g) { return meets_after(g, 0); });
}

SelfIntersections self_intersections(const TriangleMesh& mesh) {
  std::vector<bool> bad(mesh.faces.size(), false);
  std::size_t bad_count = 0;
  SelfIntersections found;
  found.complete = search_pairs(mesh, [&](std::uint32_t f, std::uint32_t g) {
    if ((bad[f] && bad[g]) || !meet(mesh.vertices, mesh.faces[f], mesh.faces[g])) return false;
    bad_count += !bad[f] + !bad[g];
    bad[f] = bad[g] = true;
    return bad_count == bad.size();
  });
  for (std::uint32_t f = 0; f < bad.size(); ++f) {
    if (bad[f]) found.faces.push_back(f);
  }
  return found;
}

std::vector<BodyPair> overlapping_bodies(const TriangleMesh& mesh,
                                         const std::vector<std::uint32_t>& body) {
  std::set<BodyPair> pairs;
  search_pairs(mesh, [&](std::uint32_t f, std::uint32_t g) {
    const BodyPair pair = std::minmax(body[f], body[g]);
    if (pair.first == pair.second || pairs.contains(pair)) return false;
    const Face &a = mesh.faces[f], &b = mesh.faces[g];
    if (lie_upon(mesh.vertices, a, b) || meet(mesh.vertices, a, b)) pairs.insert(pair);
    return false;
  });
  return {pairs.begin(), pairs.end()};
}

std::vector<std::uint32_t> self_intersecting_faces(const TriangleMesh& mesh) {
  return self_intersections(mesh).faces;
}

TriangleMesh manifold_faces(const TriangleMesh& surface) {
  check_mesh(surface, "surface to decimate");
  if (!surface.empty() && uses_all_vertices(surface) && manifold_twins(surface)) {
    return outward({.vertices = surface.vertices, .faces = surface.faces, .colors = {}});
  }
  TriangleMesh kept{.vertices = surface.vertices, .faces = {}, .colors = {}};
  std::remove_copy_if(surface.faces.begin(), surface.faces.end(), std::back_inserter(kept.faces),
                      repeats_a_corner);
  refuse_non_manifold_edges(analyse_topology(kept));

  UnionFind fans(3 * kept.faces.size());
  MeshEdges(kept).for_each([&](std::span<const EdgeUse> uses) {
    for (const EdgeUse& use : uses) join_fans(uses.front(), use, fans);
  });
  return outward(split_fans(kept, fans));
}

TriangleMesh split_fans(const TriangleMesh& mesh, UnionFind& fans) {
  TriangleMesh parted;
  std::vector<std::uint32_t> vertex_of_fan(3 * mesh.faces.size(), kNoVertexYet);
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    Face face;
    for (std::uint32_t c = 0; c < 3; ++c) {
      std::uint32_t& vertex = vertex_of_fan[fans.root(3 * f + c)];
      if (vertex == kNoVertexYet) {
        const std::uint32_t from = mesh.faces[f][c];
        vertex = static_cast<std::uint32_t>(parted.vertices.size());
        parted.vertices.push_back(mesh.vertices[from]);
        if (!mesh.colors.empty()) parted.colors.push_back(mesh.colors[from]);
      }
      face[c] = vertex;
    }
    parted.faces.push_back(face);
  }
  return parted;
}

}  // namespace organbake
