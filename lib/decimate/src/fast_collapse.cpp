// SPDX-License-Identifier: GPL-3.0-or-later
// Edge collapses without a queue: passes over all edges collapse those below a quadric error
// (Garland & Heckbert 1997) that rises from pass to pass. The order is worse than a queue's and ten
// times as fast, which is enough for surfaces that a better method thins further.
#include <Eigen/Core>
#include <algorithm>
#include <cstdint>

#include "organbake/core/quantile.h"
#include "organbake/decimate/decimate.h"
#include "organbake/geometry/mesh_edges.h"

namespace organbake {
namespace {

// Sum of weighted squared distances to planes (Garland & Heckbert 1997): xᵀA x + 2 bᵀx + c.
struct Quadric {
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;  // A
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double c = 0;

  static Quadric plane(const Eigen::Vector3d& unit_normal, const Eigen::Vector3d& point,
                       double weight) {
    const Eigen::Vector3d n = weight * unit_normal;
    const double d = -unit_normal.dot(point);
    return {n.x() * unit_normal.x(),
            n.x() * unit_normal.y(),
            n.x() * unit_normal.z(),
            n.y() * unit_normal.y(),
            n.y() * unit_normal.z(),
            n.z() * unit_normal.z(),
            d * n,
            weight * d * d};
  }

  Quadric& operator+=(const Quadric& o) {
    xx += o.xx, xy += o.xy, xz += o.xz, yy += o.yy, yz += o.yz, zz += o.zz;
    b += o.b;
    c += o.c;
    return *this;
  }

  Eigen::Vector3d times(const Eigen::Vector3d& p) const {
    return {xx * p.x() + xy * p.y() + xz * p.z(), xy * p.x() + yy * p.y() + yz * p.z(),
            xz * p.x() + yz * p.y() + zz * p.z()};
  }

  double at(const Eigen::Vector3d& p) const { return std::max(0.0, p.dot(times(p) + 2 * b) + c); }

  // The least point, drawn to `start` where the planes leave it free: (A + εI) d = −(A start + b).
  Eigen::Vector3d least_near(const Eigen::Vector3d& start) const {
    constexpr double kDraw = 1e-3;  // of A's trace
    const double e = kDraw * (xx + yy + zz);
    if (!(e > 0)) return start;
    const double a = xx + e, d = yy + e, f = zz + e;
    const double c0 = d * f - yz * yz, c1 = xz * yz - xy * f, c2 = xy * yz - xz * d;
    const double inverse = 1 / (a * c0 + xy * c1 + xz * c2);
    const Eigen::Vector3d r = -inverse * (times(start) + b);
    const double c4 = a * f - xz * xz, c5 = xy * xz - a * yz, c8 = a * d - xy * xy;
    return start + Eigen::Vector3d(c0 * r.x() + c1 * r.y() + c2 * r.z(),
                                   c1 * r.x() + c4 * r.y() + c5 * r.z(),
                                   c2 * r.x() + c5 * r.y() + c8 * r.z());
  }
};

constexpr std::uint32_t kNone = 0xFFFFFFFFu;

// Share of the edges that a pass may collapse: a larger one follows the rising error less closely.
constexpr double kShareOfEdges = 0.25;
// A pass that removes less than this share of the faces has got stuck.
constexpr double kLeastProgress = 0.005;

// Where the surface is flat, collapses cost nothing, and each would make one fan grow: what looks
// round a vertex would take the square of the faces.
constexpr int kMostFacesAtVertex = 32;

class Thinning {
 public:
  explicit Thinning(const TriangleMesh& surface)
      : points_(surface.vertices), faces_(surface.faces), alive_(surface.faces.size()) {
    const Bounds box = bounds(surface);
    center_ = box.center();  // quadrics far from the origin would cancel
    for (Eigen::Vector3d& p : points_) p -= center_;
    add_quadrics();
  }

  std::size_t alive() const { return alive_; }

  // Returns the faces removed.
  std::size_t pass(std::size_t goal) {
    compact();
    connect();
    const double limit = error_limit(goal);
    const std::size_t before = alive_;
    // Edges are met once, from their lower vertex; both corners may have moved on by then.
    for (std::uint32_t f = 0; f < faces_.size() && alive_ > goal; ++f) {
      for (int c = 0; c < 3 && faces_[f][0] != kNone; ++c) {
        const std::uint32_t a = faces_[f][c], b = faces_[f][(c + 1) % 3];
        if (a < b) consider(a, b, limit);
      }
    }
    return before - alive_;
  }

  TriangleMesh result() {
    compact();
    for (Eigen::Vector3d& p : points_) p += center_;
    return {.vertices = std::move(points_), .faces = std::move(faces_), .colors = {}};
  }

 private:
  void add_quadrics() {
    quadrics_.assign(points_.size(), {});
    for (const Face& f : faces_) {
      const Eigen::Vector3d n =
          (points_[f[1]] - points_[f[0]]).cross(points_[f[2]] - points_[f[0]]);
      const double area = n.norm();
      if (!(area > 0)) continue;
      const Quadric q = Quadric::plane(n / area, points_[f[0]], area);
      for (const std::uint32_t v : f) quadrics_[v] += q;
    }
  }

  // Drops dead faces and the vertices they alone used, so that memory stays dense.
  void compact() {
    if (alive_ == faces_.size()) return;
    faces_.erase(
        std::remove_if(faces_.begin(), faces_.end(), [](const Face& f) { return f[0] == kNone; }),
        faces_.end());
    std::vector<std::uint32_t> renumbered(points_.size(), kNone);
    for (const Face& f : faces_) {
      for (const std::uint32_t v : f) renumbered[v] = 0;
    }
    std::uint32_t kept = 0;
    for (std::size_t v = 0; v < points_.size(); ++v) {
      if (renumbered[v] == kNone) continue;
      points_[kept] = points_[v];
      quadrics_[kept] = quadrics_[v];
      renumbered[v] = kept++;
    }
    points_.resize(kept);
    quadrics_.resize(kept);
    for (Face& f : faces_) {
      for (std::uint32_t& v : f) v = renumbered[v];
    }
  }

  // Each vertex's faces; a vertex that swallows others gets their lists chained to its own.
  void connect() {
    const std::size_t n = points_.size();
    around_ = VertexFaces(faces_, n);
    chained_.assign(n, kNone);
    last_.resize(n);
    for (std::uint32_t v = 0; v < n; ++v) last_[v] = v;
    stamp_.assign(n, 0);
    stamps_ = 0;
    mark_borders();
  }

  void mark_borders() {
    border_.assign(points_.size(), 0);
    for (std::uint32_t v = 0; v < points_.size(); ++v) {
      // Round an inner vertex every neighbour is met as often leaving as arriving.
      std::uint32_t balance = 0;
      for (const std::uint32_t index : around_.of(v)) {
        const Face& f = faces_[index];
        const int c = f[0] == v ? 0 : f[1] == v ? 1 : 2;
        balance += f[(c + 1) % 3] - f[(c + 2) % 3];
      }
      border_[v] = balance != 0;
    }
  }

  double edge_error(std::uint32_t a, std::uint32_t b, Eigen::Vector3d& place) const {
    Quadric q = quadrics_[a];
    q += quadrics_[b];
    place = q.least_near(0.5 * (points_[a] + points_[b]));
    return q.at(place);
  }

  // The error below which lie as many of the edges as this pass should collapse.
  double error_limit(std::size_t goal) const {
    constexpr std::size_t kSampled = 4096;
    std::vector<double> errors;
    const std::size_t step = std::max<std::size_t>(1, faces_.size() / kSampled);
    Eigen::Vector3d place;
    for (std::size_t f = 0; f < faces_.size(); f += step) {
      const int c = static_cast<int>(f / step % 3);
      errors.push_back(edge_error(faces_[f][c], faces_[f][(c + 1) % 3], place));
    }
    // Each collapse takes two faces and three edges; some that are cheap are not allowed.
    const double wanted = 0.5 * double(alive_ - goal) / (1.5 * double(alive_)) * 1.5;
    const double share = std::min(kShareOfEdges, wanted);
    return quantile(std::move(errors), share);
  }

  template <typename Visit>
  void for_each_face(std::uint32_t v, Visit visit) const {
    for (std::uint32_t part = v; part != kNone; part = chained_[part]) {
      for (const std::uint32_t f : around_.of(part)) {
        if (faces_[f][0] != kNone) visit(f);
      }
    }
  }

  void consider(std::uint32_t a, std::uint32_t b, double limit) {
    if (border_[a] || border_[b]) return;
    Eigen::Vector3d place;
    if (edge_error(a, b, place) > limit) return;
    if (!may_collapse(a, b) || turns_a_face(a, b, place) || turns_a_face(b, a, place)) return;
    collapse(a, b, place);
  }

  // Link condition for an inner edge: exactly two common neighbours, and no tetrahedron. And no
  // vertex of very many faces.
  bool may_collapse(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t near_a = stamps_ += 2, common = near_a + 1;
    int faces_a = 0, faces_b = 0, shared = 0;
    for_each_face(a, [&](std::uint32_t f) {
      ++faces_a;
      for (const std::uint32_t v : faces_[f]) stamp_[v] = near_a;
    });
    stamp_[a] = stamp_[b] = 0;
    for_each_face(b, [&](std::uint32_t f) {
      ++faces_b;
      for (const std::uint32_t v : faces_[f]) {
        if (stamp_[v] != near_a) continue;
        stamp_[v] = common;
        ++shared;
      }
    });
    const int faces_together = faces_a + faces_b - 4;
    return shared == 2 && faces_together > 2 && faces_together <= kMostFacesAtVertex;
  }

  // Whether a face of v that survives the collapse with `other` would turn far or lose its area.
  bool turns_a_face(std::uint32_t v, std::uint32_t other, const Eigen::Vector3d& place) const {
    constexpr double kLeastCosine2 = 0.2 * 0.2;
    bool turns = false;
    for_each_face(v, [&](std::uint32_t index) {
      const Face& f = faces_[index];
      if (turns || f[0] == other || f[1] == other || f[2] == other) return;
      const int c = f[0] == v ? 0 : f[1] == v ? 1 : 2;
      const Eigen::Vector3d &p = points_[f[(c + 1) % 3]], &q = points_[f[(c + 2) % 3]];
      const Eigen::Vector3d was = (p - points_[v]).cross(q - points_[v]);
      const Eigen::Vector3d is = (p - place).cross(q - place);
      const double dot = was.dot(is), was2 = was.squaredNorm();
      turns = was2 > 0 && (dot <= 0 || dot * dot < kLeastCosine2 * was2 * is.squaredNorm());
    });
    return turns;
  }

  void collapse(std::uint32_t a, std::uint32_t b, const Eigen::Vector3d& place) {
    for_each_face(b, [&](std::uint32_t index) {
      Face& f = faces_[index];
      if (f[0] == a || f[1] == a || f[2] == a) {
        f[0] = kNone;
        --alive_;
        return;
      }
      for (std::uint32_t& v : f) v = v == b ? a : v;
    });
    chained_[last_[a]] = b;
    last_[a] = last_[b];
    points_[a] = place;
    quadrics_[a] += quadrics_[b];
  }

  std::vector<Eigen::Vector3d> points_;
  std::vector<Quadric> quadrics_;
  std::vector<Face> faces_;
  std::size_t alive_;
  Eigen::Vector3d center_;
  VertexFaces around_;
  std::vector<std::uint32_t> chained_, last_, stamp_;
  std::vector<std::uint8_t> border_;
  std::uint32_t stamps_ = 0;
};

}  // namespace

TriangleMesh fast_collapse(const TriangleMesh& surface, std::size_t faces,
                           const RunContext& context) {
  if (surface.faces.size() <= faces) return surface;
  Thinning thinning(surface);
  while (thinning.alive() > faces) {
    context.throw_if_cancelled();
    const std::size_t before = thinning.alive();
    if (thinning.pass(faces) < kLeastProgress * double(before)) break;
  }
  return thinning.result();
}

}  // namespace organbake
