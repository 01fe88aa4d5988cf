// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "organbake/image/channel_image.h"

namespace organbake {

// The layer below the cameras' samples: every proxy face carries a triangular lattice of n steps
// along its edges, (n+1)(n+2)/2 nodes, each with the surface's height over the face and its colour.
// It is the proxy with a texture of its own, drawn only where no camera's sample has weight.
// Stored as base.exr: row = face, column = node; channels R G B (half, linear), Y (height, float),
// seen (uint: bit c set when camera c < 32 sees the node with confidence).
struct BaseLayer {
  std::uint32_t steps = 0;  // n ≥ 1
  std::uint32_t face_count = 0;
  std::vector<float> height_mm;        // face-major, node-minor
  std::vector<Eigen::Vector3f> color;  // linear
  std::vector<std::uint32_t> seen_by;  // camera bits

  std::uint32_t nodes_per_face() const { return (steps + 1) * (steps + 2) / 2; }
};

// Node (i, j), i, j ≥ 0, i + j ≤ n, lies at b1 = i/n, b2 = j/n; nodes run over j within i.
inline std::uint32_t base_node_index(std::uint32_t steps, std::uint32_t i, std::uint32_t j) {
  // Row i holds steps + 1 − i nodes; the rows before it hold i(2·steps + 3 − i)/2.
  return i * (2 * steps + 3 - i) / 2 + j;
}

// Visits a face's nodes: visit(i, j, node), as base_node_index() numbers them.
template <class Visit>
void each_node(std::uint32_t steps, Visit&& visit) {
  for (std::uint32_t i = 0; i <= steps; ++i)
    for (std::uint32_t j = 0; i + j <= steps; ++j) visit(i, j, base_node_index(steps, i, j));
}

// The nodes of the lattice's small triangle that holds a place (b1, b2) of a face, or the nearest,
// and their weights.
struct LatticeMix {
  std::array<std::uint32_t, 3> nodes;
  std::array<float, 3> weights;
};
LatticeMix lattice_mix(std::uint32_t steps, const Eigen::Vector2d& at);

ChannelImage base_layer_to_image(const BaseLayer& layer);
// Throws BadDataError naming `name`; face_count is the proxy's.
BaseLayer base_layer_from_image(const ChannelImage& image, const std::string& name,
                                std::uint32_t face_count);

}  // namespace organbake
