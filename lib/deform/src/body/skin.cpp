// SPDX-License-Identifier: Apache-2.0
// The skin that instruments and tissue touch: where it lies over a face in the present pose, the
// place of it that is nearest to a point, and whether a point is inside (by solid angles, van
// Oosterom & Strackee 1983). Nodes and normals are worked out when they are asked for, because a
// step looks at few.
#include "body/skin.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "organbake/geometry/refine.h"
#include "organbake/geometry/smooth_skin.h"

namespace organbake::deform {
namespace {

// Of normals that are weighed by angles, as in geometry/triangle_mesh.h; nothing for a face of no
// area.
Double4 shares(const Double4& area, const Double4& cosine) {
  return area > 0 ? angles_of(area, cosine) / area : Double4{};
}

PaddedVector from_lanes(const Double4& v) { return {v[0], v[1], v[2], 0}; }

// Of a triangle seen from a point (van Oosterom and Strackee 1983), sr; all relative to it.
double solid_angle(const Double4& a, const Double4& b, const Double4& c) {
  const double la = std::sqrt(dot(a, a)), lb = std::sqrt(dot(b, b)), lc = std::sqrt(dot(c, c));
  const double below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
  return 2 * std::atan2(dot(a, cross(b, c)), below);
}

// Barycentric weights of the nearest point.
Eigen::Vector3d nearest_weights(const Double4& p, const Double4& a, const Double4& b,
                                const Double4& c) {
  const auto point = [](const Double4& v) { return Eigen::Vector3d(v[0], v[1], v[2]); };
  return nearest_on_triangle(point(p), point(a), point(b), point(c));
}

}  // namespace

Skin::Skin(const Tissue& tissue, const DeformBodies& bodies)
    : tissue_(&tissue),
      faces_of_slot_(tissue.faces(), tissue.size()),
      normals_(tissue.size(), PaddedVector::Zero()),
      posed_(tissue.size(), 0) {
  std::size_t first_vertex = 0;
  for (const DeformBody& body : bodies) {
    if (body.skin) {
      add_smooth_lattices(body, tissue.slot_of_vertex().data() + first_vertex);
    } else {
      add_lattices(body);
    }
    first_vertex += body.proxy.vertices.size();
  }
  at_cut_.resize(lattices_.size(), 0);
  find_carriers();
}

void Skin::add_lattices(const DeformBody& body) {
  const BaseLayer& base = body.base;
  if (base.height_mm.empty()) {
    lattices_.resize(lattices_.size() + body.proxy.faces.size());
    for (auto* heights : {&tallest_mm_, &lowest_mm_, &highest_mm_})
      heights->resize(lattices_.size(), 0.0);
    return;
  }
  for (std::size_t f = 0; f < body.proxy.faces.size(); ++f)
    add_lattice(base.steps, base.height_mm.data() + f * base.nodes_per_face());
}

void Skin::add_lattice(std::uint32_t steps, const float* heights_mm) {
  const float* const end = heights_mm + (steps + 1) * (steps + 2) / 2;
  lattices_.push_back({steps, heights_.size()});
  heights_.insert(heights_.end(), heights_mm, end);
  const auto [lowest, highest] = std::minmax_element(heights_mm, end);
  lowest_mm_.push_back(*lowest);
  highest_mm_.push_back(*highest);
  tallest_mm_.push_back(std::max(std::abs(double{*lowest}), std::abs(double{*highest})));
  tallest_of_all_mm_ = std::max(tallest_of_all_mm_, tallest_mm_.back());
}

// A node's height at rest is its place along the shell line of its lattice.
void Skin::add_smooth_lattices(const DeformBody& body, const std::uint32_t* slot_of_vertex) {
  const auto before = static_cast<std::uint32_t>(nodes_.count());
  nodes_.add(body, slot_of_vertex);
  std::vector<Eigen::Vector3d> at_rest;
  carry(*body.skin, body.proxy.vertices, at_rest);
  const Lattice lattice(body.proxy, body.skin->steps);
  const std::vector<Lattice::ShellLine> lines = lattice.shell_lines();
  std::vector<float> heights;
  for (std::uint32_t f = 0; f < body.proxy.faces.size(); ++f) {
    heights.clear();
    const std::size_t first_node = node_of_.size();
    for (std::uint32_t i = 0; i <= lattice.steps(); ++i) {
      for (std::uint32_t j = 0; i + j <= lattice.steps(); ++j) {
        const std::uint32_t n = lattice.node(f, i, j);
        const double length2 = lines[n].direction.squaredNorm();
        const double along = (at_rest[n] - lines[n].foot).dot(lines[n].direction);
        heights.push_back(static_cast<float>(length2 > 0 ? along / length2 : 0));
        node_of_.push_back(before + n);
      }
    }
    add_lattice(lattice.steps(), heights.data());
    lattices_.back().first_node = first_node;
    at_cut_.resize(lattices_.size(), 0);
    for (std::size_t n = first_node; n < node_of_.size(); ++n)
      at_cut_.back() |= body.skin->is_creased(node_of_[n] - before);
  }
}

void Skin::find_carriers() {
  leverage_.assign(lattices_.size(), 0);
  std::vector<std::uint32_t> slots, last_face;  // of each slot, the last that it carries, plus one
  for (std::uint32_t f = 0; f < lattices_.size(); ++f) {
    slots.clear();
    const std::uint32_t n = smooth(f) ? steps(f) : 0;
    for (std::uint32_t k = 0; n > 0 && k < (n + 1) * (n + 2) / 2; ++k) {
      double leverage = 0;
      for (const auto& [slot, weight] : nodes_.carriers(node_of_[lattices_[f].first_node + k])) {
        if (slot >= last_face.size()) last_face.resize(slot + 1, 0);
        if (std::exchange(last_face[slot], f + 1) != f + 1) slots.push_back(slot);
        leverage += std::abs(weight);
      }
      leverage_[f] = std::max(leverage_[f], leverage);
    }
    std::sort(slots.begin(), slots.end());
    carriers_.insert(carriers_.end(), slots.begin(), slots.end());
    carrier_start_.push_back(static_cast<std::uint32_t>(carriers_.size()));
  }
}

Skin::Cell Skin::cell_at(std::uint32_t face, double b1, double b2) const {
  const std::uint32_t n = steps(face);
  const double u = std::max(0.0, b1 * n), v = std::max(0.0, b2 * n);
  const auto i = std::min(static_cast<std::uint32_t>(u), n - 1);
  const auto j = std::min(static_cast<std::uint32_t>(v), n - 1 - i);
  const double s = b1 * n - i, t = b2 * n - j;
  if (s + t <= 1 || i + j + 2 > n) return {{{{i, j}, {i + 1, j}, {i, j + 1}}}, {1 - s - t, s, t}};
  return {{{{i + 1, j}, {i, j + 1}, {i + 1, j + 1}}}, {1 - t, 1 - s, s + t - 1}};
}

SkinPoint Skin::point_over(std::uint32_t face, double b1, double b2) const {
  const auto& [corners, weights] = cell_at(face, b1, b2);
  double height_mm = 0;
  for (int k = 0; k < 3; ++k) height_mm += weights[k] * height(face, corners[k][0], corners[k][1]);
  return {face, b1, b2, height_mm};
}

void Skin::pose(const PaddedVectors& x) {
  x_ = &x;
  nodes_.pose(x);
  if (++pose_ == 0) {  // the counter came round: no old stamp may look current
    std::fill(posed_.begin(), posed_.end(), 0u);
    pose_ = 1;
  }
}

const PaddedVector& Skin::vertex_normal(std::uint32_t slot) {
  if (posed_[slot] == pose_) return normals_[slot];
  const Double4* x = as_double4(x_->data());
  Double4 sum{};
  const std::span around = faces_of_slot_.of(slot);
  for (std::size_t k = 0; k < around.size(); k += 4) {
    const std::size_t count = std::min<std::size_t>(around.size() - k, 4);
    Double4 normal[4], squared{}, cosine{};
    for (std::size_t i = 0; i < count; ++i) {
      const Face& f = faces()[around[k + i]];
      const int corner = f[0] == slot ? 0 : f[1] == slot ? 1 : 2;
      const Double4 u = x[f[(corner + 1) % 3]] - x[slot], v = x[f[(corner + 2) % 3]] - x[slot];
      normal[i] = cross(u, v);
      squared[i] = dot(normal[i], normal[i]);
      cosine[i] = dot(u, v);
    }
    const Double4 share = shares(square_roots(squared), cosine);
    for (std::size_t i = 0; i < count; ++i) sum += share[i] * normal[i];
  }
  set_normal(slot, sum);
  return normals_[slot];
}

void Skin::set_normal(std::uint32_t slot, const Double4& sum) {
  const double length = std::sqrt(dot(sum, sum));
  normals_[slot] = length > 0 ? from_lanes(sum / length) : PaddedVector(0, 0, 1, 0);
  posed_[slot] = pose_;
}

void Skin::pose_all_normals() {
  std::fill(normals_.begin(), normals_.end(), PaddedVector::Zero());
  const Double4* x = as_double4(x_->data());
  Double4* sum = as_double4(normals_.data());
  for (const auto& [i, j, k] : faces()) {
    const Double4 ij = x[j] - x[i], jk = x[k] - x[j], ki = x[i] - x[k];
    const Double4 normal = cross(jk, ki);
    const double area = std::sqrt(dot(normal, normal));
    const Double4 share =
        shares(Double4{} + area, Double4{-dot(ij, ki), -dot(jk, ij), -dot(ki, jk), area});
    sum[i] += share[0] * normal;
    sum[j] += share[1] * normal;
    sum[k] += share[2] * normal;
  }
  for (std::uint32_t slot = 0; slot < normals_.size(); ++slot) set_normal(slot, sum[slot]);
}

SkinFace Skin::frame(std::uint32_t face) {
  const auto [i, j, k] = faces()[face];
  const Double4* x = as_double4(x_->data());
  const Double4 ni = *as_double4(&vertex_normal(i));
  const Double4 nj = *as_double4(&vertex_normal(j));
  const Double4 nk = *as_double4(&vertex_normal(k));
  return {x[i], x[j] - x[i], x[k] - x[i], ni, nj - ni, nk - ni};
}

// S(b, h) is linear in h for fixed b and in b for fixed h.
std::array<PaddedVector, 6> Skin::skin_prism(std::uint32_t face) {
  const SkinFace f = frame(face);
  const double low = lowest_mm_[face], high = highest_mm_[face];
  return {from_lanes(f.at(0, 0, low)),  from_lanes(f.at(1, 0, low)),  from_lanes(f.at(0, 1, low)),
          from_lanes(f.at(0, 0, high)), from_lanes(f.at(1, 0, high)), from_lanes(f.at(0, 1, high))};
}

SkinHit Skin::hit(const SkinPoint& at, const PaddedVector& center) {
  SkinHit hit{at};
  if (smooth(at.face)) {
    const auto& [corners, weights] = cell_at(at.face, at.b1, at.b2);
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t n = node(at.face, corners[k][0], corners[k][1]);
      hit.point += weights[k] * nodes_.point(n);
      hit.normal += weights[k] * nodes_.normal(n);
    }
  } else {
    const SkinFace f = frame(at.face);
    hit.point = from_lanes(f.at(at.b1, at.b2, at.height_mm));
    hit.normal = from_lanes(f.normal_at(at.b1, at.b2));
  }
  const double length = hit.normal.norm();
  if (length > 0) hit.normal /= length;
  hit.distance_mm = (hit.point - center).norm();
  return hit;
}

std::vector<Carrier> Skin::carriers(const SkinPoint& at) const {
  const Face& f = faces()[at.face];
  if (!smooth(at.face)) return {{f[0], 1 - at.b1 - at.b2}, {f[1], at.b1}, {f[2], at.b2}};
  std::vector<Carrier> all;
  const auto& [corners, weights] = cell_at(at.face, at.b1, at.b2);
  for (int k = 0; k < 3; ++k) {
    for (const auto& [slot, weight] :
         nodes_.carriers(node(at.face, corners[k][0], corners[k][1]))) {
      const auto known = std::find_if(
          all.begin(), all.end(), [wanted = slot](const Carrier& c) { return c.slot == wanted; });
      if (known == all.end()) {
        all.push_back({slot, weights[k] * weight});
      } else {
        known->weight += weights[k] * weight;
      }
    }
  }
  return all;
}

Skin::Box Skin::node_box(std::uint32_t face) {
  const std::size_t first = lattices_[face].first_node, n = steps(face);
  Box box{nodes_.point(node_of_[first]), nodes_.point(node_of_[first])};
  for (std::size_t k = first + 1; k < first + (n + 1) * (n + 2) / 2; ++k) {
    const PaddedVector& point = nodes_.point(node_of_[k]);
    box.low = box.low.cwiseMin(point);
    box.high = box.high.cwiseMax(point);
  }
  return box;
}

double Skin::least_distance(std::uint32_t face, const PaddedVector& center) {
  if (smooth(face)) {
    const Box box = node_box(face);
    return (box.low - center).cwiseMax(center - box.high).cwiseMax(0).norm();
  }
  const auto [i, j, k] = faces()[face];
  const Double4* x = as_double4(x_->data());
  const Double4 p = *as_double4(&center);
  const Eigen::Vector3d w = nearest_weights(p, x[i], x[j], x[k]);
  const Double4 d = w[0] * x[i] + w[1] * x[j] + w[2] * x[k] - p;
  return std::sqrt(dot(d, d));
}

// Where a node lies now; `frame` is the face's, and not looked at of a smooth one.
Double4 Skin::node_point(const SkinFace& frame, std::uint32_t face, std::uint32_t i,
                         std::uint32_t j) {
  if (smooth(face)) return *as_double4(&nodes_.point(node(face, i, j)));
  return frame.at(double(i) / steps(face), double(j) / steps(face), height(face, i, j));
}

SkinPoint Skin::nearest_in_cell(const SkinFace& frame, std::uint32_t face, const Double4& center,
                                const std::uint32_t (&corners)[3][2], double& squared) {
  const auto& [p, q, r] = corners;
  const Double4 a = node_point(frame, face, p[0], p[1]), b = node_point(frame, face, q[0], q[1]),
                c = node_point(frame, face, r[0], r[1]);
  const Eigen::Vector3d w = nearest_weights(center, a, b, c);
  const SkinPoint at{face, (w[0] * p[0] + w[1] * q[0] + w[2] * r[0]) / steps(face),
                     (w[0] * p[1] + w[1] * q[1] + w[2] * r[1]) / steps(face),
                     w[0] * height(face, p[0], p[1]) + w[1] * height(face, q[0], q[1]) +
                         w[2] * height(face, r[0], r[1])};
  const Double4 found =
      smooth(face) ? Double4(w[0] * a + w[1] * b + w[2] * c) : frame.at(at.b1, at.b2, at.height_mm);
  const Double4 d = found - center;
  squared = dot(d, d);
  return at;
}

SkinHit Skin::nearest(std::uint32_t face, const PaddedVector& center) {
  const SkinFace f = smooth(face) ? SkinFace{} : frame(face);
  const Double4 c = *as_double4(&center);
  if (tallest_mm_[face] == 0 && !smooth(face)) {
    const Eigen::Vector3d w =
        nearest_weights(c, f.origin, f.origin + f.along1, f.origin + f.along2);
    return hit({face, w[1], w[2], 0}, center);
  }
  const std::uint32_t steps = this->steps(face);
  std::uint32_t ni = 0, nj = 0;
  double best = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i <= steps; ++i) {
    for (std::uint32_t j = 0; i + j <= steps; ++j) {
      const Double4 d = node_point(f, face, i, j) - c;
      const double squared = dot(d, d);
      if (squared < best) best = squared, ni = i, nj = j;
    }
  }
  // The cells round the node: three that point up the lattice, three that point down.
  SkinPoint at{face, double(ni) / steps, double(nj) / steps, height(face, ni, nj)};
  const auto try_cell = [&](int i, int j, bool up) {
    const int n = static_cast<int>(steps);
    if (i < 0 || j < 0 || i + j + (up ? 1 : 2) > n) return;
    const std::uint32_t u = i, v = j;
    double squared = 0;
    const SkinPoint found =
        up ? nearest_in_cell(f, face, c, {{u, v}, {u + 1, v}, {u, v + 1}}, squared)
           : nearest_in_cell(f, face, c, {{u + 1, v}, {u + 1, v + 1}, {u, v + 1}}, squared);
    if (squared < best) best = squared, at = found;
  };
  const int i = static_cast<int>(ni), j = static_cast<int>(nj);
  try_cell(i, j, true), try_cell(i - 1, j, true), try_cell(i, j - 1, true);
  try_cell(i - 1, j, false), try_cell(i - 1, j - 1, false), try_cell(i, j - 1, false);
  return hit(at, center);
}

SkinHit Skin::nearest(const PaddedVector& center) {
  SkinHit best;
  best.distance_mm = std::numeric_limits<double>::infinity();
  for (std::uint32_t face = 0; face < faces().size(); ++face) {
    if (least_distance(face, center) >= best.distance_mm) continue;
    const SkinHit hit = nearest(face, center);
    if (hit.distance_mm < best.distance_mm) best = hit;
  }
  return best;
}

bool Skin::encloses(const PaddedVector& point, std::span<const std::uint32_t> of_faces) const {
  constexpr double kHalfRound = 2 * std::numbers::pi;  // sr
  const Double4* x = as_double4(x_->data());
  const Double4 from = *as_double4(&point);
  double sum = 0;
  for (const std::uint32_t face : of_faces) {
    const auto& [i, j, k] = faces()[face];
    sum += solid_angle(x[i] - from, x[j] - from, x[k] - from);
  }
  return sum > kHalfRound;
}

bool Skin::encloses(const PaddedVector& point) const {
  std::vector<std::uint32_t> all(faces().size());
  std::iota(all.begin(), all.end(), 0u);
  return encloses(point, all);
}

void Skin::nodes_within(std::uint32_t face, const PaddedVector& center, double radius_mm,
                        std::vector<SkinHit>& hits) {
  const std::uint32_t steps = this->steps(face);
  for (std::uint32_t i = 0; i <= steps; ++i) {
    for (std::uint32_t j = 0; i + j <= steps; ++j) {
      const SkinHit h =
          hit({face, double(i) / steps, double(j) / steps, height(face, i, j)}, center);
      if (h.distance_mm <= radius_mm) hits.push_back(h);
    }
  }
}

}  // namespace organbake::deform
