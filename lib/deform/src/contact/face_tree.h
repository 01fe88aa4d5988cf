// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "body/skin.h"
#include "body/tissue.h"
#include "contact/padded_vector.h"

namespace organbake::deform {

struct FacePair {
  std::uint32_t a = 0, b = 0;
};

// A hierarchy of boxes over the proxies' faces, for tissue that may meet tissue. Boxes hold the
// skin over their faces. Beside them cones hold the directions that faces look in: parts that look
// the same way, within a right angle, cannot meet (Volino & Thalmann 1994), so that a smooth organ
// costs next to nothing.
class FaceTree {
 public:
  FaceTree(const Tissue& tissue, Skin& skin);

  // The pairs of faces in the skin's pose that may meet: their skins' boxes come within margin_mm
  // of each other and they look against each other; of one piece they share no vertex and were no
  // front and back of the same flesh at rest.
  void find_pairs(double margin_mm, std::vector<FacePair>& pairs);

 private:
  struct Box {
    PaddedVector low, high;
    bool meets(const Box& other) const {
      return (low.array() <= other.high.array()).all() && (other.low.array() <= high.array()).all();
    }
  };
  using Prism = std::array<PaddedVector, 6>;  // Skin::skin_prism
  struct Cone {
    PaddedVector axis;
    Angle half;  // half a turn holds everything
  };
  struct Node {
    std::uint32_t first = 0, last = 0;  // of order_
    std::uint32_t left = 0, right = 0;  // 0: a leaf
    Box box;
    Cone cone;
  };
  std::uint32_t piece_in_tree(std::uint32_t face) const;
  std::uint32_t build(std::uint32_t first, std::uint32_t last);
  std::uint32_t split(std::uint32_t first, std::uint32_t last);
  void fit(double margin_mm);
  void fit_leaf(Node& node);
  void join(Node& node) const;
  void meet_itself(std::uint32_t node, std::vector<FacePair>& pairs) const;
  void meet(std::uint32_t a, std::uint32_t b, std::vector<FacePair>& pairs) const;
  void meet_faces(std::uint32_t f, std::uint32_t g, std::vector<FacePair>& pairs) const;
  bool apart_along(const PaddedVector& normal, const Prism& own, const Prism& other) const;
  bool front_and_back_at_rest(std::uint32_t f, std::uint32_t g) const;

  const Tissue& tissue_;
  Skin& skin_;
  PaddedVectors rest_center_, rest_normal_;  // of the faces
  std::vector<std::uint32_t> order_;         // faces
  std::vector<Node> nodes_;                  // parents before their children
  std::vector<Box> box_;                     // of the faces' skin, now
  PaddedVectors normal_;
  double margin_mm_ = 0;
};

}  // namespace organbake::deform
