// SPDX-License-Identifier: Apache-2.0
#include "support/skins.h"

#include <map>

#include "organbake/geometry/adjacency.h"
#include "organbake/geometry/lattice.h"

namespace organbake {

SmoothSkin flat_skin(const TriangleMesh& proxy, std::uint32_t steps) {
  const Lattice lattice(proxy, steps);
  std::vector<std::array<double, 3>> weights(lattice.node_count());
  std::vector<std::uint32_t> face(lattice.node_count());
  for (std::uint32_t f = 0; f < proxy.faces.size(); ++f) {
    for (std::uint32_t i = 0; i <= steps; ++i) {
      for (std::uint32_t j = 0; i + j <= steps; ++j) {
        const double b1 = double(i) / steps, b2 = double(j) / steps;
        weights[lattice.node(f, i, j)] = {1 - b1 - b2, b1, b2};
        face[lattice.node(f, i, j)] = f;
      }
    }
  }
  SmoothSkin skin;
  skin.steps = steps;
  skin.first.push_back(0);
  for (std::uint32_t n = 0; n < lattice.node_count(); ++n) {
    for (int corner = 0; corner < 3; ++corner) {
      skin.carrier.push_back(proxy.faces[face[n]][corner]);
      skin.weight.push_back(weights[n][corner]);
    }
    skin.first.push_back(static_cast<std::uint32_t>(skin.carrier.size()));
  }
  return skin;
}

SmoothSkin spread_skin(const TriangleMesh& proxy, std::uint32_t steps, double share) {
  const SmoothSkin flat = flat_skin(proxy, steps);
  const VertexNeighbours neighbours(proxy.faces, proxy.vertices.size());
  SmoothSkin skin;
  skin.steps = steps;
  skin.first.push_back(0);
  for (std::size_t n = 0; n < flat.node_count(); ++n) {
    std::map<std::uint32_t, double> weights;
    for (std::uint32_t k = flat.first[n]; k < flat.first[n + 1]; ++k) {
      const auto around = neighbours.of(flat.carrier[k]);
      weights[flat.carrier[k]] += (1 - share) * flat.weight[k];
      for (const std::uint32_t v : around)
        weights[v] += share / double(around.size()) * flat.weight[k];
    }
    for (const auto& [vertex, weight] : weights) {
      skin.carrier.push_back(vertex);
      skin.weight.push_back(weight);
    }
    skin.first.push_back(static_cast<std::uint32_t>(skin.carrier.size()));
  }
  complete_weights(skin);
  return skin;
}

}  // namespace organbake
