// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/smooth_skin.h"

#include <algorithm>
#include <cmath>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/lattice.h"

namespace organbake {

void complete_weights(SmoothSkin& skin) {
  for (std::size_t n = 0; n < skin.node_count(); ++n) {
    const auto begin = skin.weight.begin() + skin.first[n];
    const auto end = skin.weight.begin() + skin.first[n + 1];
    if (begin == end) continue;
    double others = 0;
    const auto largest = std::max_element(begin, end);
    for (auto w = begin; w != end; ++w) others += w == largest ? 0 : *w;
    *largest = 1 - others;
  }
}

void check_smooth_skin(const SmoothSkin& skin, const TriangleMesh& proxy, const std::string& name) {
  constexpr double kMostWeight = 100;  // smooth weights stay below 2
  constexpr double kSumWithin = 1e-4;  // of 1: some dozen rounded weights
  const auto fail = [&](const std::string& what) { throw BadDataError(name + ": " + what); };
  if (skin.steps < 1) fail("has no steps");
  const Lattice lattice(proxy, skin.steps);
  if (skin.node_count() != lattice.node_count()) {
    fail("holds " + std::to_string(skin.node_count()) + " nodes where " +
         std::to_string(skin.steps) + " steps over this proxy have " +
         std::to_string(lattice.node_count()));
  }
  if (skin.first.front() != 0 || skin.first.back() != skin.carrier.size() ||
      skin.carrier.size() != skin.weight.size()) {
    fail("its carriers and weights are not of one number");
  }
  for (std::size_t n = 0; n < skin.node_count(); ++n) {
    if (skin.first[n] >= skin.first[n + 1]) fail("node " + std::to_string(n) + " has no carriers");
    double sum = 0;
    for (std::uint32_t k = skin.first[n]; k < skin.first[n + 1]; ++k) {
      if (skin.carrier[k] >= proxy.vertices.size()) {
        fail("node " + std::to_string(n) + " is carried by vertex " +
             std::to_string(skin.carrier[k]) + ", which the proxy does not have");
      }
      if (!(std::abs(skin.weight[k]) <= kMostWeight)) {
        fail("node " + std::to_string(n) + " has a weight that no smooth skin has");
      }
      sum += skin.weight[k];
    }
    if (!(std::abs(sum - 1) <= kSumWithin)) {
      fail("the weights of node " + std::to_string(n) + " do not sum to 1");
    }
  }
}

std::vector<Face> smooth_skin_faces(const TriangleMesh& proxy, std::uint32_t steps) {
  const Lattice lattice(proxy, steps);
  std::vector<Face> faces;
  faces.reserve(proxy.faces.size() * steps * steps);
  for (std::uint32_t f = 0; f < proxy.faces.size(); ++f) {
    for (std::uint32_t i = 0; i < steps; ++i) {
      for (std::uint32_t j = 0; i + j < steps; ++j) {
        const std::uint32_t along1 = lattice.node(f, i + 1, j), along2 = lattice.node(f, i, j + 1);
        faces.push_back({lattice.node(f, i, j), along1, along2});
        if (i + j + 2 <= steps) faces.push_back({along1, lattice.node(f, i + 1, j + 1), along2});
      }
    }
  }
  return faces;
}

void carry(const SmoothSkin& skin, const std::vector<Eigen::Vector3d>& proxy_positions,
           std::vector<Eigen::Vector3d>& nodes) {
  nodes.resize(skin.node_count());
  constexpr std::size_t kGrain = 1024;
  parallel_pieces(std::size_t{0}, nodes.size(), kGrain, [&](std::size_t n, std::size_t last) {
    for (; n < last; ++n) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (std::uint32_t k = skin.first[n]; k < skin.first[n + 1]; ++k)
        sum += skin.weight[k] * proxy_positions[skin.carrier[k]];
      nodes[n] = sum;
    }
  });
}

TriangleMesh smooth_skin_mesh(const TriangleMesh& proxy, const SmoothSkin& skin) {
  TriangleMesh mesh;
  mesh.faces = smooth_skin_faces(proxy, skin.steps);
  carry(skin, proxy.vertices, mesh.vertices);
  return mesh;
}

}  // namespace organbake
