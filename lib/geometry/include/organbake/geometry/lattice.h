// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The nodes of the base layer's lattices over a proxy, each counted once: faces that share a vertex
// or an edge share its nodes, so the layer cannot crack there.
class Lattice {
 public:
  // A node's line through the shell, S(h) = foot + h · direction (not a unit vector).
  struct ShellLine {
    Eigen::Vector3d foot, direction;
  };

  Lattice(const TriangleMesh& proxy, std::uint32_t steps);

  std::uint32_t steps() const { return steps_; }
  std::uint32_t node_count() const { return first_inner_ + inner_per_face() * face_count_; }
  // Node (i, j) of a face, at b1 = i / steps, b2 = j / steps.
  std::uint32_t node(std::uint32_t face, std::uint32_t i, std::uint32_t j) const;
  // By node. An edge's nodes are computed from its two ends in the order of their indices.
  std::vector<ShellLine> shell_lines() const;

 private:
  std::uint32_t inner_per_face() const { return (steps_ - 1) * (steps_ - 2) / 2; }
  std::uint32_t on_edge(std::uint32_t face, int edge, std::uint32_t from_first) const;

  const TriangleMesh& proxy_;
  std::uint32_t steps_;
  std::uint32_t face_count_;
  std::vector<std::array<std::uint32_t, 2>> edges_;       // vertices, lower index first
  std::vector<std::array<std::uint32_t, 3>> face_edges_;  // of corners 0–1, 1–2, 2–0
  std::uint32_t first_inner_ = 0;
};

// Steps along an edge so that nodes lie about step_mm apart: 1…64, and no more nodes in all faces
// than max_nodes, where one step allows it.
std::uint32_t lattice_steps(const TriangleMesh& proxy, double step_mm, std::size_t max_nodes);

}  // namespace organbake
