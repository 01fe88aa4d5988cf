// SPDX-License-Identifier: Apache-2.0
// Pairs of faces whose skins may touch, by a tree of boxes that is built once and fitted anew in
// each pose. Cones of normals (Volino & Thalmann 1994) rule out parts that cannot touch themselves.
#include "contact/contact_search.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace organbake::deform {
namespace {

constexpr std::uint32_t kLeafFaces = 4;

PaddedVector normal_of(const PaddedVector& a, const PaddedVector& b, const PaddedVector& c) {
  const PaddedVector u = b - a, v = c - a;
  const Double4 n = cross(*as_double4(&u), *as_double4(&v));
  const double length = std::sqrt(dot(n, n));
  return length > 0 ? PaddedVector(n[0] / length, n[1] / length, n[2] / length, 0)
                    : PaddedVector(PaddedVector::Zero());
}

bool share_a_vertex(const Face& f, const Face& g) {
  return has_corner(g, f[0]) || has_corner(g, f[1]) || has_corner(g, f[2]);
}

}  // namespace

FaceTree::FaceTree(const Tissue& tissue, Skin& skin)
    : tissue_(tissue),
      skin_(skin),
      order_(tissue.faces().size()),
      box_(order_.size()),
      normal_(order_.size()) {
  const PaddedVectors& x = tissue.rest();
  for (const auto& [i, j, k] : tissue.faces()) {
    rest_center_.push_back((x[i] + x[j] + x[k]) / 3);
    rest_normal_.push_back(normal_of(x[i], x[j], x[k]));
  }
  std::iota(order_.begin(), order_.end(), 0u);
  std::vector<std::size_t> pieces_of_organ;
  for (const Tissue::Piece& piece : tissue.pieces()) {
    pieces_of_organ.resize(std::max<std::size_t>(pieces_of_organ.size(), piece.organ + 1));
    ++pieces_of_organ[piece.organ];
  }
  std::erase_if(order_, [&](std::uint32_t f) {
    return skin.at_cut(f) && pieces_of_organ[tissue.organ_of_face(f)] == 1;
  });
  const auto piece = [&](std::uint32_t f) { return piece_in_tree(f); };
  std::stable_sort(order_.begin(), order_.end(),
                   [&](std::uint32_t f, std::uint32_t g) { return piece(f) < piece(g); });
  if (!order_.empty()) build(0, static_cast<std::uint32_t>(order_.size()));
}

std::uint32_t FaceTree::build(std::uint32_t first, std::uint32_t last) {
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  std::uint32_t left = 0, right = 0;
  if (last - first > kLeafFaces) {
    const std::uint32_t middle = split(first, last);
    left = build(first, middle);
    right = build(middle, last);
  }
  nodes_[number].first = first, nodes_[number].last = last;
  nodes_[number].left = left, nodes_[number].right = right;
  return number;
}

// Pieces of organs that are cut move apart, and have trees of their own; whole organs are one.
std::uint32_t FaceTree::piece_in_tree(std::uint32_t face) const {
  const std::uint32_t piece = tissue_.piece_of_face(face);
  return tissue_.pieces()[piece].cut ? piece + 1 : 0;
}

// Where the faces are divided: between pieces, or at the median along the longest side.
std::uint32_t FaceTree::split(std::uint32_t first, std::uint32_t last) {
  const auto begin = order_.begin() + first, end = order_.begin() + last;
  const std::uint32_t middle = (first + last) / 2;
  if (const std::uint32_t of_first = piece_in_tree(*begin);
      of_first != piece_in_tree(order_[last - 1])) {
    const std::uint32_t of_middle = std::max(of_first + 1, piece_in_tree(order_[middle]));
    const auto next = std::partition_point(
        begin, end, [&](std::uint32_t f) { return piece_in_tree(f) < of_middle; });
    return static_cast<std::uint32_t>(next - order_.begin());
  }
  PaddedVector low = rest_center_[order_[first]], high = low;
  std::for_each(begin, end, [&](std::uint32_t f) {
    low = low.cwiseMin(rest_center_[f]), high = high.cwiseMax(rest_center_[f]);
  });
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  std::nth_element(begin, order_.begin() + middle, end, [&](std::uint32_t f, std::uint32_t g) {
    const double at_f = rest_center_[f][axis], at_g = rest_center_[g][axis];
    return at_f != at_g ? at_f < at_g : f < g;
  });
  return middle;
}

void FaceTree::find_pairs(double margin_mm, std::vector<FacePair>& pairs) {
  pairs.clear();
  if (nodes_.empty()) return;
  fit(margin_mm);
  meet_itself(0, pairs);
}

void FaceTree::fit(double margin_mm) {
  margin_mm_ = margin_mm;
  const PaddedVectors& x = skin_.shape();
  skin_.pose_all_normals();
  for (const std::uint32_t f : order_) {
    const auto [i, j, k] = tissue_.faces()[f];
    const Prism prism = skin_.skin_prism(f);
    Box& box = box_[f] = {prism[0], prism[0]};
    for (const PaddedVector& corner : prism) {
      box.low = box.low.cwiseMin(corner), box.high = box.high.cwiseMax(corner);
    }
    box.low.array() -= margin_mm / 2;
    box.high.array() += margin_mm / 2;
    normal_[f] = normal_of(x[i], x[j], x[k]);
  }
  for (std::size_t n = nodes_.size(); n-- > 0;) {
    if (nodes_[n].left) {
      join(nodes_[n]);
    } else {
      fit_leaf(nodes_[n]);
    }
  }
}

void FaceTree::fit_leaf(Node& node) {
  node.box = box_[order_[node.first]];
  PaddedVector sum = PaddedVector::Zero();
  for (std::uint32_t k = node.first; k < node.last; ++k) {
    const Box& box = box_[order_[k]];
    node.box.low = node.box.low.cwiseMin(box.low);
    node.box.high = node.box.high.cwiseMax(box.high);
    sum += normal_[order_[k]];
  }
  const double length = sum.norm();
  node.cone = {length > 0 ? PaddedVector(sum / length) : sum, length > 0 ? kNoAngle : kHalfTurn};
  for (std::uint32_t k = node.first; k < node.last; ++k) {
    node.cone.half = wider(node.cone.half, Angle::between(node.cone.axis, normal_[order_[k]]));
  }
}

void FaceTree::join(Node& node) const {
  const Node& left = nodes_[node.left];
  const Node& right = nodes_[node.right];
  node.box = {left.box.low.cwiseMin(right.box.low), left.box.high.cwiseMax(right.box.high)};
  const PaddedVector sum = left.cone.axis + right.cone.axis;
  const double length = sum.norm();
  node.cone = {length > 0 ? PaddedVector(sum / length) : sum, kHalfTurn};
  if (!(length > 0)) return;
  node.cone.half = wider(Angle::between(node.cone.axis, left.cone.axis) + left.cone.half,
                         Angle::between(node.cone.axis, right.cone.axis) + right.cone.half);
}

void FaceTree::meet_itself(std::uint32_t number, std::vector<FacePair>& pairs) const {
  const Node& node = nodes_[number];
  if ((node.cone.half + node.cone.half).acute()) return;
  if (node.left) {
    meet_itself(node.left, pairs);
    meet_itself(node.right, pairs);
    return meet(node.left, node.right, pairs);
  }
  for (std::uint32_t k = node.first; k < node.last; ++k) {
    for (std::uint32_t l = k + 1; l < node.last; ++l) meet_faces(order_[k], order_[l], pairs);
  }
}

void FaceTree::meet(std::uint32_t a, std::uint32_t b, std::vector<FacePair>& pairs) const {
  const Node& p = nodes_[a];
  const Node& q = nodes_[b];
  if (!p.box.meets(q.box)) return;
  if ((Angle::between(p.cone.axis, q.cone.axis) + p.cone.half + q.cone.half).acute()) return;
  const bool split_p = p.left && (!q.left || p.last - p.first >= q.last - q.first);
  if (split_p) return meet(p.left, b, pairs), meet(p.right, b, pairs);
  if (q.left) return meet(a, q.left, pairs), meet(a, q.right, pairs);
  for (std::uint32_t k = p.first; k < p.last; ++k) {
    for (std::uint32_t l = q.first; l < q.last; ++l) meet_faces(order_[k], order_[l], pairs);
  }
}

void FaceTree::meet_faces(std::uint32_t f, std::uint32_t g, std::vector<FacePair>& pairs) const {
  if (normal_[f].dot(normal_[g]) > 0 || !box_[f].meets(box_[g])) return;
  const bool of_one = tissue_.piece_of_face(f) == tissue_.piece_of_face(g);
  // The walls of a cut lie on each other from the first: within a piece they are let pass.
  if (of_one &&
      (skin_.at_cut(f) || skin_.at_cut(g) ||
       share_a_vertex(tissue_.faces()[f], tissue_.faces()[g]) || front_and_back_at_rest(f, g))) {
    return;
  }
  const Prism of_f = skin_.skin_prism(f), of_g = skin_.skin_prism(g);
  if (apart_along(normal_[f], of_f, of_g) || apart_along(normal_[g], of_g, of_f)) return;
  pairs.push_back({f, g});
}

// Whether a slab along a face's normal that holds its skin and the margin leaves out all of the
// other's.
bool FaceTree::apart_along(const PaddedVector& normal, const Prism& own, const Prism& other) const {
  const auto span = [&](const Prism& prism) {
    double low = normal.dot(prism[0]), high = low;
    for (const PaddedVector& corner : prism) {
      const double at = normal.dot(corner);
      low = std::min(low, at), high = std::max(high, at);
    }
    return std::pair(low, high);
  };
  const auto [low, high] = span(own);
  const auto [other_low, other_high] = span(other);
  return other_low > high + margin_mm_ || other_high < low - margin_mm_;
}

bool FaceTree::front_and_back_at_rest(std::uint32_t f, std::uint32_t g) const {
  const PaddedVector way = rest_center_[g] - rest_center_[f];
  return rest_normal_[f].dot(rest_normal_[g]) < 0 && way.dot(rest_normal_[f]) < 0 &&
         way.dot(rest_normal_[g]) > 0;
}

}  // namespace organbake::deform
