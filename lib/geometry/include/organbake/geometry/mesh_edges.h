// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Half-edge h = 3·face + corner runs from that corner to the next one of its face.
inline constexpr std::uint32_t kNoHalfEdge = 0xFFFFFFFFu;
inline std::uint32_t next_in_face(std::uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
inline std::uint32_t previous_in_face(std::uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }

// One number for both directions of an edge, in the order of its lower and then its higher vertex.
inline std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
}

// One face at one of its edges.
struct EdgeUse {
  std::uint32_t low, high;                // the edge's vertices, low < high
  std::uint32_t low_corner, high_corner;  // where the face has them, 3·face + corner

  std::uint32_t face() const { return low_corner / 3; }
  bool up() const { return next_in_face(low_corner) == high_corner; }  // runs from low to high
  std::uint32_t half_edge() const { return up() ? low_corner : high_corner; }
  std::uint32_t opposite_corner() const { return previous_in_face(half_edge()); }
};

// The edges of any triangles, each with all faces that use it: one at a border, two inside a
// manifold, more where sheets meet. A face with a repeated corner has no edge from that vertex to
// itself. Memory: 16 bytes for each edge of each face; time: in proportion to the faces.
class MeshEdges {
 public:
  // Corners must be below vertex_count.
  MeshEdges(const std::vector<Face>& faces, std::size_t vertex_count);
  explicit MeshEdges(const TriangleMesh& mesh) : MeshEdges(mesh.faces, mesh.vertices.size()) {}

  // Calls visit(std::span<const EdgeUse>) for each edge, by its lower and then its higher vertex,
  // with its faces in increasing order.
  template <typename Visit>
  void for_each(Visit visit) const {
    const EdgeUse* const end = uses_.data() + uses_.size();
    for (const EdgeUse* first = uses_.data(); first != end;) {
      const EdgeUse* last = first + 1;
      while (last != end && last->high == first->high && last->low == first->low) ++last;
      visit(std::span(first, last));
      first = last;
    }
  }

  // Of all edges together: 3 for each face without a repeated corner.
  std::size_t use_count() const { return uses_.size(); }

 private:
  std::vector<EdgeUse> uses_;
};

// The half-edge on the other side of each, kNoHalfEdge at a border and where three or more faces
// meet. Whether the two run against each other, as they should, is not looked at.
std::vector<std::uint32_t> half_edge_twins(const TriangleMesh& mesh);

// The same for a consistently wound manifold in which every vertex has one fan of faces; nothing
// for any other mesh.
std::optional<std::vector<std::uint32_t>> manifold_twins(const TriangleMesh& mesh);

// Faces round each vertex, increasing.
class VertexFaces {
 public:
  VertexFaces() = default;
  VertexFaces(const std::vector<Face>& faces, std::size_t vertex_count);
  std::span<const std::uint32_t> of(std::uint32_t vertex) const {
    return {faces_.data() + first_[vertex], first_[vertex + 1] - first_[vertex]};
  }

 private:
  std::vector<std::uint32_t> first_;
  std::vector<std::uint32_t> faces_;
};

// Vertices that share an edge with each vertex, increasing, each once.
class VertexNeighbours {
 public:
  VertexNeighbours(const std::vector<Face>& faces, std::size_t vertex_count);
  std::span<const std::uint32_t> of(std::uint32_t vertex) const {
    return {neighbours_.data() + first_[vertex], first_[vertex + 1] - first_[vertex]};
  }

 private:
  std::vector<std::uint32_t> first_;
  std::vector<std::uint32_t> neighbours_;
};

}  // namespace organbake
