// SPDX-License-Identifier: Apache-2.0
// Divides one tetrahedron, some of whose edges are cut, into pieces with closed surfaces: for each
// group of corners that still hang together, its parts of the four faces and the walls inside. A
// face is divided by its own edges alone, so that the two tetrahedra beside it agree without asking
// each other.
#include "tetrahedron_pieces.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "organbake/core/union_find.h"

namespace organbake {

int tetrahedron_edge(int a, int b) {
  if (a > b) std::swap(a, b);
  return a == 0 ? b - 1 : a + b;
}

TetrahedronPieces::TetrahedronPieces(const TetrahedralBody& body, const EdgeCrossings& edges,
                                     std::uint32_t tetrahedron)
    : body_(body), tetrahedron_(tetrahedron) {
  const auto& nodes = body.tetrahedra[tetrahedron].nodes;
  UnionFind joined(4);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int cuts = 0;
  for (int e = 0; e < 6; ++e) {
    const auto [a, b] = kTetrahedronEdges[e];
    edge_[e] = edges.index_of(nodes[a], nodes[b]);
    cut_[e] = edges.cut(edge_[e]);
    if (!cut_[e]) {
      joined.join(std::uint32_t(a), std::uint32_t(b));
      continue;
    }
    const auto [first, second] = edges.edge(edge_[e]);
    const double share = edges[edge_[e]].share();
    place_[e] = (1 - share) * body.nodes_mm[first] + share * body.nodes_mm[second];
    sum += place_[e];
    ++cuts;
  }
  for (int k = 0; k < 4; ++k) groups_[k] = static_cast<int>(joined.root(std::uint32_t(k)));
  if (cuts > 0) middle_ = {PieceVertex::Kind::middle, {tetrahedron}, sum / cuts};
}

PieceVertex TetrahedronPieces::node(int corner) const {
  const std::uint32_t n = body_.tetrahedra[tetrahedron_].nodes[corner];
  return {PieceVertex::Kind::node, {n}, body_.nodes_mm[n]};
}

PieceVertex TetrahedronPieces::cut_place(int a, int b) const {
  const int e = tetrahedron_edge(a, b);
  return {PieceVertex::Kind::edge, {edge_[e]}, place_[e]};
}

PieceVertex TetrahedronPieces::face_middle(int face) const {
  const auto& [a, b, c] = kTetrahedronFaces[face];
  PieceVertex middle{PieceVertex::Kind::face, {}, Eigen::Vector3d::Zero()};
  // Summed in an order that both who share the face have.
  std::array<PieceVertex, 3> places = {cut_place(a, b), cut_place(b, c), cut_place(c, a)};
  std::sort(places.begin(), places.end());
  for (const PieceVertex& place : places) middle.at_mm += place.at_mm / 3;
  middle.of = {node(a).of[0], node(b).of[0], node(c).of[0]};
  std::sort(middle.of.begin(), middle.of.end());
  return middle;
}

std::vector<TetrahedronPieces::Line> TetrahedronPieces::lines(int face) const {
  const auto& f = kTetrahedronFaces[face];
  const std::array<bool, 3> cuts = {cut(f[0], f[1]), cut(f[1], f[2]), cut(f[2], f[0])};
  const int count = cuts[0] + cuts[1] + cuts[2];
  std::vector<Line> lines;
  for (int k = 0; k < 3; ++k) {
    const int a = f[k], b = f[(k + 1) % 3], c = f[(k + 2) % 3];
    // From edge a–b to edge a–c the corner a lies to the left.
    if (count == 2 && !cuts[(k + 1) % 3]) {
      lines.push_back({cut_place(a, b), cut_place(a, c), a, b});
    } else if (count == 3) {
      lines.push_back({cut_place(a, b), face_middle(face), a, b});
    }
  }
  return lines;
}

std::vector<TetrahedronPieces::Triangle> TetrahedronPieces::face_piece(int face, int corner) const {
  const auto& f = kTetrahedronFaces[face];
  const auto at = std::find(f.begin(), f.end(), corner) - f.begin();
  if (at == 3) return {};
  const int a = corner, b = f[(at + 1) % 3], c = f[(at + 2) % 3];
  const int count = cut(a, b) + cut(b, c) + cut(c, a);
  if (count == 3) {
    const PieceVertex middle = face_middle(face);
    return {{node(a), cut_place(a, b), middle}, {node(a), middle, cut_place(a, c)}};
  }
  if (count < 2) {  // in one piece: the whole face is its lowest corner's
    if (corner != *std::min_element(f.begin(), f.end())) return {};
    // Others who meet the edge that is cut see its place.
    if (cut(b, c))
      return {{node(a), node(b), cut_place(b, c)}, {node(a), cut_place(b, c), node(c)}};
    if (cut(a, b))
      return {{node(c), node(a), cut_place(a, b)}, {node(c), cut_place(a, b), node(b)}};
    if (cut(c, a))
      return {{node(b), node(c), cut_place(c, a)}, {node(b), cut_place(c, a), node(a)}};
    return {{node(a), node(b), node(c)}};
  }
  if (cut(a, b) && cut(a, c)) return {{node(a), cut_place(a, b), cut_place(a, c)}};
  // The other two keep a quadrangle together; the one that comes first of them round it has all.
  if (cut(a, b)) return {};  // then b is cut off, and c comes before a
  return {{node(a), node(b), cut_place(b, c)}, {node(a), cut_place(b, c), cut_place(c, a)}};
}

std::vector<TetrahedronPieces::Triangle> TetrahedronPieces::walls(int group) const {
  std::vector<Triangle> walls;
  for (int face = 0; face < 4; ++face) {
    for (const Line& line : lines(face)) {
      const bool left = groups_[line.left] == group, right = groups_[line.right] == group;
      if (left == right) continue;
      // The piece of the left corner ends at the line: its wall runs against the face's piece.
      if (left) {
        walls.push_back({line.to, line.from, middle_});
      } else {
        walls.push_back({line.from, line.to, middle_});
      }
    }
  }
  return walls;
}

double TetrahedronPieces::volume_mm3(int group) const {
  double six = 0;
  const Eigen::Vector3d origin = middle_.at_mm;
  for (int corner = 0; corner < 4; ++corner) {
    if (groups_[corner] != group) continue;
    for (int face = 0; face < 4; ++face) {
      for (const auto& [a, b, c] : face_piece(face, corner)) {
        six += (a.at_mm - origin).cross(b.at_mm - origin).dot(c.at_mm - origin);
      }
    }
  }
  return six / 6;
}

}  // namespace organbake
