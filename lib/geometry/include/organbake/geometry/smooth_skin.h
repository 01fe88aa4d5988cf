// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
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

// A smooth skin over a coarse proxy. Every face of the proxy is cut into steps² small ones, whose
// vertices, the nodes of its Lattice, are fixed affine combinations of the
// proxy's vertices near by:
//   x_n = Σ w_k X_k,   Σ w_k = 1,
// at rest and in every deformed pose. Rigid and affine motions of the proxy are therefore the
// skin's to rounding, whatever the weights are; smooth weights make a smooth skin. The mechanics
// know nothing of it: it stands between them and all that is seen and touched.
struct SmoothSkin {
  std::uint32_t steps = 0;             // of each edge of the proxy, ≥ 1
  std::vector<std::uint32_t> first;    // node n has the carriers first[n] … first[n + 1] − 1
  std::vector<std::uint32_t> carrier;  // vertices of the proxy; a node's differ
  std::vector<double> weight;          // of each carrier
  // By node, set where a blade has cut the skin; empty: nowhere. Edges that end there stay
  // straight, so that skin and the cut's wall, which bend each in its own way, keep their border.
  std::vector<std::uint8_t> creased = {};

  bool is_creased(std::size_t node) const { return !creased.empty() && creased[node] != 0; }
  std::size_t node_count() const { return first.empty() ? 0 : first.size() - 1; }
  std::size_t faces_per_proxy_face() const { return std::size_t{steps} * steps; }
};

// Makes each node's weights sum to 1 to rounding, whatever they were stored in: the largest takes
// what is missing. They must be nearly so already.
void complete_weights(SmoothSkin& skin);

// Throws BadDataError, beginning with `name`, for a skin that does not fit the proxy.
void check_smooth_skin(const SmoothSkin& skin, const TriangleMesh& proxy, const std::string& name);

// The faces of the skin, by its nodes. Those of face f of the proxy are f · steps² onwards: for i
// and j as a Lattice counts them the one with the corners (i, j), (i + 1, j), (i, j + 1), then,
// unless it would leave the face, (i + 1, j), (i + 1, j + 1), (i, j + 1).
std::vector<Face> smooth_skin_faces(const TriangleMesh& proxy, std::uint32_t steps);

// The nodes when the proxy's vertices lie at `proxy_positions` (mm).
void carry(const SmoothSkin& skin, const std::vector<Eigen::Vector3d>& proxy_positions,
           std::vector<Eigen::Vector3d>& nodes);

// The skin at rest, without colours.
TriangleMesh smooth_skin_mesh(const TriangleMesh& proxy, const SmoothSkin& skin);

}  // namespace organbake
