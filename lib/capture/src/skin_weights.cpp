// SPDX-License-Identifier: GPL-3.0-or-later
#include "skin_targets.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <queue>
#include <utility>

#include "organbake/geometry/adjacency.h"
#include "thin_plate.h"

namespace organbake {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::size_t kPlateVertices = 24;  // that a plate runs through
constexpr double kTwist = 0.5;         // a turn of 1 rad counts as this share of its vertex's edges
constexpr double kPlateReach = 1.2;    // of its vertex's longest edge: how far a plate counts
constexpr double kLeastWeight = 3e-3;  // a smaller one moves no node visibly
// Weights whose sizes sum to more than this come from vertices that say too little.
constexpr double kMostLeverage = 10;

// The vertices that lie nearest along the edges (Dijkstra 1959), the vertex itself first.
std::vector<std::uint32_t> nearest_along(const VertexNeighbours& graph,
                                         const std::vector<Vector3d>& vertices, std::uint32_t from,
                                         std::size_t count) {
  using Reached = std::pair<double, std::uint32_t>;  // mm; the lower index first among equals
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> open;
  std::vector<std::uint32_t> nearest;
  std::vector<char> done(vertices.size(), 0);
  open.emplace(0, from);
  while (!open.empty() && nearest.size() < count) {
    const auto [away, v] = open.top();
    open.pop();
    if (std::exchange(done[v], 1)) continue;
    nearest.push_back(v);
    for (const std::uint32_t w : graph.of(v)) {
      if (!done[w]) open.emplace(away + (vertices[v] - vertices[w]).norm(), w);
    }
  }
  return nearest;
}

struct PlateOfVertex {
  std::vector<std::uint32_t> through;
  ThinPlate plate;
};

std::vector<PlateOfVertex> make_plates(const TriangleMesh& proxy,
                                       const std::vector<DirectedPlace>& samples) {
  const VertexNeighbours graph(proxy.faces, proxy.vertices.size());
  std::vector<PlateOfVertex> plates(proxy.vertices.size());
  tbb::parallel_for(std::size_t{0}, plates.size(), [&](std::size_t v) {
    const auto vertex = static_cast<std::uint32_t>(v);
    plates[v].through = nearest_along(graph, proxy.vertices, vertex, kPlateVertices);
    double sum_mm = 0, longest_mm = 0;
    for (const std::uint32_t w : graph.of(vertex)) {
      const double edge_mm = (proxy.vertices[v] - proxy.vertices[w]).norm();
      sum_mm += edge_mm;
      longest_mm = std::max(longest_mm, edge_mm);
    }
    const std::size_t edges = graph.of(vertex).size();
    const double edge_mm = edges == 0 ? 0 : sum_mm / double(edges);
    std::vector<DirectedPlace> through;
    for (const std::uint32_t w : plates[v].through) through.push_back(samples[w]);
    plates[v].plate = ThinPlate(through, kTwist * edge_mm, kPlateReach * longest_mm);
  });
  return plates;
}

using Carriers = std::vector<std::pair<std::uint32_t, double>>;  // by vertex

void add(Carriers& carriers, std::uint32_t vertex, double weight) {
  const auto at = std::lower_bound(carriers.begin(), carriers.end(), vertex,
                                   [](const auto& c, std::uint32_t v) { return c.first < v; });
  if (at != carriers.end() && at->first == vertex) {
    at->second += weight;
  } else {
    carriers.insert(at, {vertex, weight});
  }
}

// A node's place on its face of the proxy.
struct NodePlace {
  std::uint32_t face = 0;
  std::array<double, 3> weights{};
};

std::vector<NodePlace> node_places(const TriangleMesh& proxy, const Lattice& lattice) {
  std::vector<NodePlace> places(lattice.node_count());
  const std::uint32_t n = lattice.steps();
  for (std::uint32_t f = static_cast<std::uint32_t>(proxy.faces.size()); f-- > 0;) {
    for (std::uint32_t i = 0; i <= n; ++i) {
      for (std::uint32_t j = 0; i + j <= n; ++j) {
        const double b1 = double(i) / n, b2 = double(j) / n;
        places[lattice.node(f, i, j)] = {f, {1 - b1 - b2, b1, b2}};
      }
    }
  }
  return places;
}

Carriers carriers_of(const DirectedPlace& node, const NodePlace& place, const TriangleMesh& proxy,
                     const std::vector<PlateOfVertex>& plates) {
  const Face& corners = proxy.faces[place.face];
  std::vector<std::uint32_t> near;
  for (const std::uint32_t corner : corners)
    near.insert(near.end(), plates[corner].through.begin(), plates[corner].through.end());
  std::sort(near.begin(), near.end());
  near.erase(std::unique(near.begin(), near.end()), near.end());

  Carriers carriers;
  double shares = 0, leverage = 0;
  for (const std::uint32_t v : near) {
    const double share = plates[v].plate.share(node);
    if (share == 0) continue;
    const VectorXd weights = plates[v].plate.weights(node);
    shares += share;
    leverage += share * weights.lpNorm<1>();
    for (std::size_t k = 0; k < plates[v].through.size(); ++k)
      add(carriers, plates[v].through[k], share * weights[static_cast<Eigen::Index>(k)]);
  }
  if (!(shares > 0 && leverage <= kMostLeverage * shares)) {
    carriers.clear();  // on its face, as without a smooth skin
    for (int k = 0; k < 3; ++k) add(carriers, corners[k], place.weights[k]);
    shares = 1;
  }
  for (auto& [vertex, weight] : carriers) weight /= shares;
  std::erase_if(carriers, [](const auto& c) { return std::abs(c.second) < kLeastWeight; });
  return carriers;
}

}  // namespace

SmoothSkin skin_weights(const TriangleMesh& proxy, const Lattice& lattice,
                        const std::vector<SkinTarget>& targets) {
  const auto sample_of = [&](const Vector3d& at, std::size_t node) {
    return DirectedPlace{at, targets[node].normal};
  };
  std::vector<DirectedPlace> vertices;  // they are the first nodes
  for (std::size_t v = 0; v < proxy.vertices.size(); ++v)
    vertices.push_back(sample_of(proxy.vertices[v], v));
  const std::vector<PlateOfVertex> plates = make_plates(proxy, vertices);
  const std::vector<NodePlace> places = node_places(proxy, lattice);
  std::vector<Carriers> carriers(targets.size());
  tbb::parallel_for(std::size_t{0}, targets.size(), [&](std::size_t n) {
    carriers[n] = carriers_of(sample_of(targets[n].at_mm, n), places[n], proxy, plates);
  });

  SmoothSkin skin;
  skin.steps = lattice.steps();
  skin.first.push_back(0);
  for (const Carriers& node : carriers) {
    for (const auto& [vertex, weight] : node) {
      skin.carrier.push_back(vertex);
      skin.weight.push_back(static_cast<float>(weight));  // as it is stored
    }
    skin.first.push_back(static_cast<std::uint32_t>(skin.carrier.size()));
  }
  complete_weights(skin);
  return skin;
}

}  // namespace organbake
