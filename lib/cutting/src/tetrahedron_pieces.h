// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "organbake/bundle/mechanics_model.h"
#include "organbake/cutting/cut_sheet.h"

namespace organbake {

// The corners of each face, seen from outside counter-clockwise; face k lies opposite to corner k.
inline constexpr std::array<std::array<int, 3>, 4> kTetrahedronFaces = {
    {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
inline constexpr std::array<std::array<int, 2>, 6> kTetrahedronEdges = {
    {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};
int tetrahedron_edge(int a, int b);  // the number of the edge between two corners

// A place in a cut mesh that all who meet there name alike.
struct PieceVertex {
  enum class Kind : std::uint8_t { node, edge, face, middle } kind = Kind::node;
  std::array<std::uint32_t, 3> of{};  // the node; the edge; the face's nodes in order; tetrahedron
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();

  bool operator<(const PieceVertex& other) const {
    return kind != other.kind ? kind < other.kind : of < other.of;
  }
};

// A tetrahedron in pieces, one for each of its corners, when some of its edges are cut. Its faces
// fall apart by their own three edges alone, so that both who share one see the same: two cut edges
// cut off the corner between them along a line, three meet in the face's middle. From these lines
// walls lead to the mean of all cut places.
class TetrahedronPieces {
 public:
  using Triangle = std::array<PieceVertex, 3>;

  TetrahedronPieces(const TetrahedralBody& body, const EdgeCrossings& edges,
                    std::uint32_t tetrahedron);

  // Groups of corners that edges which are whole join; the lowest corner names each.
  const std::array<int, 4>& groups() const { return groups_; }
  bool falls_apart() const { return groups_ != std::array{0, 0, 0, 0}; }
  // What of a face belongs to one of its corners, outward; empty when the face does not reach it.
  std::vector<Triangle> face_piece(int face, int corner) const;
  // The walls of the piece of one group, outward.
  std::vector<Triangle> walls(int group) const;
  double volume_mm3(int group) const;

 private:
  struct Line {  // on a face, with the left corner to its left, seen from outside
    PieceVertex from, to;
    int left, right;
  };
  PieceVertex node(int corner) const;
  PieceVertex cut_place(int a, int b) const;
  bool cut(int a, int b) const { return cut_[tetrahedron_edge(a, b)]; }
  PieceVertex face_middle(int face) const;
  std::vector<Line> lines(int face) const;

  const TetrahedralBody& body_;
  std::uint32_t tetrahedron_;
  std::array<bool, 6> cut_{};
  std::array<std::uint32_t, 6> edge_{};
  std::array<Eigen::Vector3d, 6> place_;
  std::array<int, 4> groups_{};
  PieceVertex middle_;
};

}  // namespace organbake
