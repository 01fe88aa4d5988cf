// SPDX-License-Identifier: GPL-3.0-or-later
// The union of overlapping bodies by corefinement in exact arithmetic (CGAL): in floating point,
// whether two faces cross hangs on rounding, and one wrong answer tears the result.
#include "united_pieces.h"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <array>
#include <map>
#include <unordered_map>

#include "organbake/core/union_find.h"
#include "organbake/decimate/mesh_defects.h"
#include "organbake/raycast/ray_scene.h"
#include "organbake/raycast/winding.h"

namespace organbake {
namespace {

using ExactKernel = CGAL::Exact_predicates_exact_constructions_kernel;
using ExactMesh = CGAL::Surface_mesh<ExactKernel::Point_3>;
namespace PMP = CGAL::Polygon_mesh_processing;

// What overlaps is joined; the members of each set in ascending order.
std::vector<std::vector<std::uint32_t>> overlapping_sets(const TriangleMesh& outward,
                                                         const std::vector<MeshPiece>& pieces) {
  TriangleMesh closed{outward.vertices, {}, {}};
  std::vector<std::uint32_t> piece_of_face;
  for (std::uint32_t p = 0; p < pieces.size(); ++p) {
    if (!pieces[p].closed) continue;
    for (const std::uint32_t f : pieces[p].faces) closed.faces.push_back(outward.faces[f]);
    piece_of_face.resize(closed.faces.size(), p);
  }
  UnionFind joined(pieces.size());
  for (const auto& [a, b] : overlapping_bodies(closed, piece_of_face)) joined.join(a, b);
  std::map<std::uint32_t, std::vector<std::uint32_t>> members;
  for (std::uint32_t p = 0; p < pieces.size(); ++p) members[joined.root(p)].push_back(p);
  std::vector<std::vector<std::uint32_t>> sets;
  for (auto& [root, set] : members)
    if (set.size() > 1) sets.push_back(std::move(set));
  return sets;
}

// Empty where the piece is no manifold.
ExactMesh exact_mesh(const TriangleMesh& mesh, const MeshPiece& piece) {
  ExactMesh exact;
  std::unordered_map<std::uint32_t, ExactMesh::Vertex_index> number;
  for (const std::uint32_t f : piece.faces) {
    std::array<ExactMesh::Vertex_index, 3> corners;
    for (int c = 0; c < 3; ++c) {
      const auto [found, added] = number.try_emplace(mesh.faces[f][c]);
      const Eigen::Vector3d& p = mesh.vertices[mesh.faces[f][c]];
      if (added) found->second = exact.add_vertex(ExactKernel::Point_3(p.x(), p.y(), p.z()));
      corners[c] = found->second;
    }
    if (exact.add_face(corners) == ExactMesh::null_face()) return {};
  }
  return exact;
}

// Empty where the pieces cross themselves, or their union is no manifold.
ExactMesh union_of(const TriangleMesh& outward, const std::vector<MeshPiece>& pieces,
                   const std::vector<std::uint32_t>& set) {
  ExactMesh all = exact_mesh(outward, pieces[set.front()]);
  for (std::size_t i = 1; i < set.size(); ++i) {
    ExactMesh next = exact_mesh(outward, pieces[set[i]]), both;
    if (all.is_empty() || next.is_empty()) return {};
    try {
      const auto strict = PMP::parameters::throw_on_self_intersection(true);
      if (!PMP::corefine_and_compute_union(all, next, both, strict)) return {};
    } catch (const PMP::Corefinement::Self_intersection_exception&) {
      return {};
    }
    both.collect_garbage();
    all = std::move(both);
  }
  return all;
}

TriangleMesh rounded(const ExactMesh& exact) {
  TriangleMesh mesh;
  for (const auto v : exact.vertices()) {
    const ExactKernel::Point_3& p = exact.point(v);
    mesh.vertices.emplace_back(CGAL::to_double(p.x()), CGAL::to_double(p.y()),
                               CGAL::to_double(p.z()));
  }
  for (const auto f : exact.faces()) {
    Face face{};
    std::size_t corner = 0;
    for (const auto v : exact.vertices_around_face(exact.halfedge(f)))
      face[corner++] = static_cast<std::uint32_t>(v);
    mesh.faces.push_back(face);
  }
  return mesh;
}

void append(TriangleMesh& mesh, const TriangleMesh& other) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const Face& f : other.faces)
    mesh.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
}

// Of the nearest place of the surface that had them.
void color_from(const TriangleMesh& colored, TriangleMesh& mesh) {
  if (colored.colors.empty()) return;
  const RayScene scene(colored);
  for (std::size_t v = mesh.colors.size(); v < mesh.vertices.size(); ++v) {
    const ClosestPoint nearest = scene.closest_point(mesh.vertices[v]);
    const Face& face = colored.faces[nearest.face];
    const auto distance = [&](std::uint32_t corner) {
      return (colored.vertices[corner] - nearest.point).squaredNorm();
    };
    mesh.colors.push_back(colored.colors[*std::min_element(
        face.begin(), face.end(), [&](auto a, auto b) { return distance(a) < distance(b); })]);
  }
}

// As of solids, whichever way they are wound.
TriangleMesh turned_outward(const TriangleMesh& mesh, std::vector<MeshPiece>& pieces) {
  TriangleMesh outward = mesh;
  for (MeshPiece& piece : pieces) {
    if (piece.volume_mm3 >= 0) continue;
    turn_faces(outward, piece.faces);
    piece.volume_mm3 = -piece.volume_mm3;
  }
  return outward;
}

}  // namespace

UnitedPieces unite_overlapping_pieces(TriangleMesh& mesh) {
  UnitedPieces summary;
  std::vector<MeshPiece> pieces = pieces_of(mesh);
  if (pieces.size() < 2) return summary;
  const TriangleMesh outward = turned_outward(mesh, pieces);
  std::vector<bool> gone(mesh.faces.size(), false);
  TriangleMesh all_united;
  for (const auto& set : overlapping_sets(outward, pieces)) {
    double sum_mm3 = 0, largest_mm3 = 0;
    for (const std::uint32_t p : set) {
      sum_mm3 += pieces[p].volume_mm3;
      largest_mm3 = std::max(largest_mm3, pieces[p].volume_mm3);
      for (const std::uint32_t f : pieces[p].faces) gone[f] = true;
    }
    const TriangleMesh united = rounded(union_of(outward, pieces, set));
    const double volume_mm3 = signed_volume(united);
    constexpr double kRounding = 1e-6;
    // A union is no smaller than its largest part, and no larger than all of them.
    const bool sound =
        volume_mm3 >= (1 - kRounding) * largest_mm3 && volume_mm3 <= (1 + kRounding) * sum_mm3;
    summary.refused |= !sound;
    summary.pieces += set.size();
    summary.shared_mm3 += sum_mm3 - (sound ? volume_mm3 : largest_mm3);
    append(all_united, united);
  }
  if (summary.pieces == 0 || summary.refused) return summary;
  TriangleMesh result{mesh.vertices, {}, mesh.colors};
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    if (!gone[f]) result.faces.push_back(mesh.faces[f]);
  append(result, all_united);
  color_from(mesh, result);
  mesh = std::move(result);
  return summary;
}

}  // namespace organbake
