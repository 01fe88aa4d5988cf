// SPDX-License-Identifier: GPL-3.0-or-later
// Folded slivers laid flat by edge flips, each of which must flatten the sharpest edge concerned:
// the sharpest edge of the whole falls, so that the flips end.
#include "unfold_faces.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// Faces over one edge are folded when their normals are farther apart than a right angle.
constexpr double kFoldedCosine = 0;
constexpr double kLeastGain = 1e-3;  // of the cosine: rounding flips nothing to and fro
// The most that a flip may move the surface, as a share of the flipped edge.
constexpr double kMostMoved = 0.1;

// A mesh whose edges can be flipped, with each half-edge's twin.
class Flippable {
 public:
  Flippable(TriangleMesh& mesh, std::vector<std::uint32_t> twins)
      : mesh_(&mesh), twins_(std::move(twins)), neighbours_(mesh.vertices.size()) {
    for (const Face& f : mesh.faces)
      for (int k = 0; k < 3; ++k) {
        neighbours_[f[k]].insert(f[(k + 1) % 3]);
        neighbours_[f[(k + 1) % 3]].insert(f[k]);
      }
  }

  std::uint32_t half_edges() const { return static_cast<std::uint32_t>(twins_.size()); }
  bool folded(std::uint32_t h) const {
    return twins_[h] != kNoHalfEdge && cosine(normal(h / 3), normal(twins_[h] / 3)) < kFoldedCosine;
  }
  // Flips the edge if that lays its faces flatter.
  bool flip_if_flatter(std::uint32_t h);

 private:
  std::uint32_t from(std::uint32_t h) const { return mesh_->faces[h / 3][h % 3]; }
  const Vector3d& point(std::uint32_t vertex) const { return mesh_->vertices[vertex]; }
  Vector3d normal(std::uint32_t f) const {
    const Face& face = mesh_->faces[f];
    return normal(face[0], face[1], face[2]);
  }
  Vector3d normal(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    return (point(b) - point(a)).cross(point(c) - point(a));
  }
  // −1 for a face of no area: it is as bad as a fold.
  static double cosine(const Vector3d& a, const Vector3d& b) {
    const double lengths = a.norm() * b.norm();
    return lengths > 0 ? a.dot(b) / lengths : -1;
  }
  void link(std::uint32_t h, std::uint32_t twin) {
    twins_[h] = twin;
    if (twin != kNoHalfEdge) twins_[twin] = h;
  }

  TriangleMesh* mesh_;
  std::vector<std::uint32_t> twins_;
  std::vector<std::set<std::uint32_t>> neighbours_;
};

bool Flippable::flip_if_flatter(std::uint32_t h) {
  const std::uint32_t t = twins_[h];
  if (t == kNoHalfEdge) return false;
  // Faces (a, b, c) and (b, a, d) become (a, d, c) and (b, c, d).
  const std::uint32_t a = from(h), b = from(t);
  const std::uint32_t c = from(previous_in_face(h)), d = from(previous_in_face(t));
  if (c == d || neighbours_[c].count(d) > 0) return false;
  const std::uint32_t outer_bc = twins_[next_in_face(h)], outer_ca = twins_[previous_in_face(h)];
  const std::uint32_t outer_ad = twins_[next_in_face(t)], outer_db = twins_[previous_in_face(t)];

  const Vector3d abc = normal(a, b, c), bad = normal(b, a, d);
  const Vector3d adc = normal(a, d, c), bcd = normal(b, c, d);
  const double volume = std::abs(abc.dot(point(d) - point(a)));
  const double largest = std::max(adc.norm(), bcd.norm());
  if (volume > kMostMoved * (point(b) - point(a)).norm() * largest) return false;
  double before = cosine(abc, bad), after = cosine(adc, bcd);
  const auto outside = [&](std::uint32_t outer, const Vector3d& was, const Vector3d& becomes) {
    if (outer == kNoHalfEdge) return;
    const Vector3d there = normal(outer / 3);
    before = std::min(before, cosine(was, there));
    after = std::min(after, cosine(becomes, there));
  };
  outside(outer_bc, abc, bcd), outside(outer_ca, abc, adc);
  outside(outer_ad, bad, adc), outside(outer_db, bad, bcd);
  if (after < before + kLeastGain) return false;

  const std::uint32_t f = 3 * (h / 3), g = 3 * (t / 3);
  mesh_->faces[h / 3] = {a, d, c};
  mesh_->faces[t / 3] = {b, c, d};
  link(f, outer_ad), link(f + 1, g + 1), link(f + 2, outer_ca);
  link(g, outer_bc), link(g + 2, outer_db);
  neighbours_[a].erase(b), neighbours_[b].erase(a);
  neighbours_[c].insert(d), neighbours_[d].insert(c);
  return true;
}

}  // namespace

std::size_t unfold_faces(TriangleMesh& mesh) {
  auto twins = manifold_twins(mesh);
  if (!twins) return 0;
  Flippable flippable(mesh, std::move(*twins));
  constexpr int kMostSweeps = 8;
  std::size_t flips = 0;
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    const std::size_t before = flips;
    for (std::uint32_t h = 0; h < flippable.half_edges(); ++h) {
      if (!flippable.folded(h)) continue;
      const std::uint32_t first = 3 * (h / 3);
      for (const std::uint32_t edge : {first, first + 1, first + 2})
        flips += flippable.flip_if_flatter(edge);
    }
    if (flips == before) break;
  }
  return flips;
}

}  // namespace organbake
