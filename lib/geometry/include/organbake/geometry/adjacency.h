// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

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
