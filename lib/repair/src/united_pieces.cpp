// SPDX-License-Identifier: GPL-3.0-or-later
// The union of overlapping bodies by corefinement in exact arithmetic (CGAL): in floating point,
// whether two faces cross hangs on rounding, and one wrong answer tears the result.
#include "repair_steps.h"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <unordered_map>

#include "organbake/decimate/mesh_measures.h"
#include "organbake/raycast/face_queries.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {
namespace {

using ExactKernel = CGAL::Exact_predicates_exact_constructions_kernel;
using ExactMesh = CGAL::Surface_mesh<ExactKernel::Point_3>;
namespace PMP = CGAL::Polygon_mesh_processing;

// Pairs of closed pieces whose faces meet: that overlap, or touch.
std::vector<BodyPair> meeting_pieces(const TriangleMesh& outward,
                                     const std::vector<MeshPiece>& pieces) {
  TriangleMesh closed{outward.vertices, {}, {}};
  std::vector<std::uint32_t> piece_of_face;
  for (std::uint32_t p = 0; p < pieces.size(); ++p) {
    if (!pieces[p].closed) continue;
    for (const std::uint32_t f : pieces[p].faces) closed.faces.push_back(outward.faces[f]);
    piece_of_face.resize(closed.faces.size(), p);
  }
  return overlapping_bodies(closed, piece_of_face);
}

using PieceSet = std::vector<std::uint32_t>;

// What meets is joined; the members of each set in ascending order.
std::vector<PieceSet> joined_sets(const std::vector<BodyPair>& pairs, std::size_t pieces) {
  UnionFind joined(pieces);
  for (const auto& [a, b] : pairs) joined.join(a, b);
  std::map<std::uint32_t, PieceSet> members;
  for (std::uint32_t p = 0; p < pieces; ++p) members[joined.root(p)].push_back(p);
  std::vector<PieceSet> sets;
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

// Whether a body's inside reaches into the other's: by points just below its faces, which the
// bodies' common lines have cut.
bool reaches_into(const ExactMesh& body, const ExactMesh& other) {
  constexpr double kBelow = 1e-9;  // of the face's size, so that none lies on the other's skin
  const CGAL::Side_of_triangle_mesh<ExactMesh, ExactKernel> side(other);
  for (const auto face : body.faces()) {
    std::array<ExactKernel::Point_3, 3> corners;
    std::size_t corner = 0;
    for (const auto v : body.vertices_around_face(body.halfedge(face)))
      corners[corner++] = body.point(v);
    const auto along = corners[1] - corners[0], up = corners[2] - corners[0];
    const auto normal = CGAL::cross_product(along, up);
    const auto middle = CGAL::centroid(corners[0], corners[1], corners[2]);
    const double size = std::sqrt(CGAL::to_double(along.squared_length()));
    const double area = std::sqrt(CGAL::to_double(normal.squared_length()));
    if (!(area > 0)) continue;
    if (side(middle - normal * (kBelow * size / area)) == CGAL::ON_BOUNDED_SIDE) return true;
  }
  return false;
}

// False for bodies that only touch: at points, along edges or over faces. Where that cannot be
// told, since they cross themselves, they are taken to overlap.
bool overlap(ExactMesh a, ExactMesh b) {
  try {
    PMP::corefine(a, b, PMP::parameters::throw_on_self_intersection(true));
  } catch (const PMP::Corefinement::Self_intersection_exception&) {
    return true;
  }
  return reaches_into(a, b) || reaches_into(b, a);
}

// Empty where the pieces cross themselves, or their union is no manifold.
ExactMesh union_of(const TriangleMesh& outward, const std::vector<MeshPiece>& pieces,
                   const PieceSet& set) {
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
  return triangles_of(exact, [](const ExactKernel::Point_3& p) {
    return Eigen::Vector3d(CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z()));
  });
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

// Unites the sets one by one, and knows what became of the pieces.
class Union {
 public:
  Union(const TriangleMesh& outward, const std::vector<MeshPiece>& pieces)
      : outward_(outward), pieces_(pieces), gone_(outward.faces.size(), false) {}

  void unite(std::vector<BodyPair> pairs) {
    for (const PieceSet& set : joined_sets(pairs, pieces_.size())) {
      if (unite(set)) continue;
      // Bodies that touch along an edge have no manifold round both. They stay as they are.
      std::vector<BodyPair> overlapping;
      for (const auto& [a, b] : pairs)
        if (std::binary_search(set.begin(), set.end(), a) &&
            overlap(exact_mesh(outward_, pieces_[a]), exact_mesh(outward_, pieces_[b])))
          overlapping.emplace_back(a, b);
      for (const PieceSet& part : joined_sets(overlapping, pieces_.size()))
        if (!unite(part)) refuse(part);
    }
  }

  const UnitedPieces& summary() const { return summary_; }
  const TriangleMesh& united() const { return united_; }
  bool is_gone(std::size_t face) const { return gone_[face]; }

 private:
  bool unite(const PieceSet& set) {
    const TriangleMesh united = rounded(union_of(outward_, pieces_, set));
    const double volume_mm3 = signed_volume(united);
    constexpr double kRounding = 1e-6;
    // A union is no smaller than its largest part, and no larger than all of them.
    const bool sound = volume_mm3 >= (1 - kRounding) * largest_mm3(set) &&
                       volume_mm3 <= (1 + kRounding) * sum_mm3(set);
    if (!sound) return false;
    summary_.pieces += set.size();
    summary_.shared_mm3 += sum_mm3(set) - volume_mm3;
    for (const std::uint32_t p : set)
      for (const std::uint32_t f : pieces_[p].faces) gone_[f] = true;
    append(united_, united);
    return true;
  }

  void refuse(const PieceSet& set) {
    summary_.refused = true;
    summary_.pieces += set.size();
    summary_.shared_mm3 += sum_mm3(set) - largest_mm3(set);
  }

  double sum_mm3(const PieceSet& set) const {
    double sum = 0;
    for (const std::uint32_t p : set) sum += pieces_[p].volume_mm3;
    return sum;
  }
  double largest_mm3(const PieceSet& set) const {
    double largest = 0;
    for (const std::uint32_t p : set) largest = std::max(largest, pieces_[p].volume_mm3);
    return largest;
  }

  const TriangleMesh& outward_;
  const std::vector<MeshPiece>& pieces_;
  std::vector<bool> gone_;
  UnitedPieces summary_;
  TriangleMesh united_;
};

}  // namespace

UnitedPieces unite_overlapping_pieces(TriangleMesh& mesh) {
  std::vector<MeshPiece> pieces = pieces_of(mesh);
  if (pieces.size() < 2) return {};
  const TriangleMesh outward = turned_outward(mesh, pieces);
  Union all(outward, pieces);
  all.unite(meeting_pieces(outward, pieces));
  if (all.summary().pieces == 0 || all.summary().refused) return all.summary();
  TriangleMesh result{mesh.vertices, {}, mesh.colors};
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    if (!all.is_gone(f)) result.faces.push_back(mesh.faces[f]);
  append(result, all.united());
  color_from(mesh, result);
  mesh = std::move(result);
  return all.summary();
}

}  // namespace organbake
