// SPDX-License-Identifier: GPL-3.0-or-later
// The smooth skin of a proxy. Nodes are put on the surface along shell lines and smoothed, so that
// bumps smaller than the skin stay in the microstructure. Then fixed weights are found that carry
// each node by the vertices near it: the motion of the vertices interpolated by thin plates (Duchon
// 1977: the kernel r³ beside affine functions, which it reproduces), one through the vertices
// nearest to each vertex along the proxy, blended into one smooth map by weights that fade with the
// distance (a partition of unity: Babuška & Melenk 1997; the kernel: Wendland 1995). A place counts
// together with its direction, r² = |Δx|² + ℓ² |Δn|² with ℓ half an edge of the proxy: two sides of
// a thin sheet or of a fold, however near, are then far from each other. Where the vertices near by
// lie in a plane they say nothing of what leaves it: the skin stays in the plane and the rest is
// microstructure.
#include "organbake/capture/capture.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <utility>

#include "baking.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/geometry/mesh_checks.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {
namespace {

// Where a node of a smooth skin should lie at rest.
struct SkinTarget {
  Eigen::Vector3d at_mm;
  Eigen::Vector3d normal;  // unit, outward, smooth over about an edge of the proxy
};

using Eigen::Vector3d;

// A face that leans farther against its proxy's face is taken for folded.
constexpr double kFoldedCosine = 0.1;
constexpr int kMostUnfoldings = 12;

// Each value half its own, half its neighbours' mean.
template <class Value>
void smooth(std::vector<Value>& values, const VertexNeighbours& neighbours, int passes) {
  for (int pass = 0; pass < passes; ++pass) {
    std::vector<Value> next = values;
    for (std::uint32_t n = 0; n < values.size(); ++n) {
      const auto around = neighbours.of(n);
      if (around.empty()) continue;
      Value sum = 0 * values[n];
      for (const std::uint32_t other : around) sum += values[other];
      next[n] = 0.5 * values[n] + 0.5 * (sum / double(around.size()));
    }
    values = std::move(next);
  }
}

std::vector<Vector3d> lifted(const std::vector<Lattice::ShellLine>& lines,
                             const std::vector<double>& heights) {
  std::vector<Vector3d> points(lines.size());
  for (std::size_t n = 0; n < lines.size(); ++n)
    points[n] = lines[n].foot + heights[n] * lines[n].direction;
  return points;
}

// Lets bumps of a face or two of the skin fade. Smooths the points, not their heights, which have a
// notch along the proxy's edges: without it the skin would be creased there. What a second pass
// moves is taken back from the first, lest all that is round shrinks.
void level(const std::vector<Lattice::ShellLine>& lines, const VertexNeighbours& neighbours,
           std::vector<double>& heights) {
  std::vector<Vector3d> once = lifted(lines, heights);
  smooth(once, neighbours, 1);
  std::vector<Vector3d> twice = once;
  smooth(twice, neighbours, 1);
  for (std::size_t n = 0; n < lines.size(); ++n) {
    const Vector3d& up = lines[n].direction;
    if (up.isZero(0)) continue;
    heights[n] = (2 * once[n] - twice[n] - lines[n].foot).dot(up) / up.squaredNorm();
  }
}

// Lowers the nodes of folded faces towards the proxy, which has none, until none is left.
void unfold(const TriangleMesh& proxy, const std::vector<Lattice::ShellLine>& lines,
            TriangleMesh& skin, std::vector<double>& heights) {
  const std::size_t cells = skin.faces.size() / std::max<std::size_t>(1, proxy.faces.size());
  for (int round = 0; round < kMostUnfoldings; ++round) {
    std::vector<char> folded(heights.size(), 0);
    bool any = false;
    for (std::size_t f = 0; f < skin.faces.size(); ++f) {
      if (!(face_normal(skin, f).dot(face_normal(proxy, f / cells)) < kFoldedCosine)) continue;
      for (const std::uint32_t n : skin.faces[f]) folded[n] = 1;
      any = true;
    }
    if (!any) return;
    for (std::size_t n = 0; n < heights.size(); ++n) {
      if (folded[n]) heights[n] *= 0.5;
    }
    skin.vertices = lifted(lines, heights);
  }
}

using Eigen::VectorXd;

// On the surface, where the nodes' shell lines meet it, without bumps too small for the skin: those
// stay in the microstructure. No face of the skin is turned over against its proxy's. By node.
std::vector<SkinTarget> skin_targets(const TriangleMesh& proxy, const Lattice& lattice,
                                     const TracedSurface& surface, double reach_mm,
                                     const RunContext& context) {
  const std::vector<Lattice::ShellLine> lines = lattice.shell_lines();
  std::vector<double> heights;
  heights.reserve(lines.size());
  for (const RayHit& hit : shell_hits(lines, surface, reach_mm, context))
    heights.push_back(std::clamp(hit.t, -reach_mm, reach_mm));

  TriangleMesh skin;
  skin.faces = smooth_skin_faces(proxy, lattice.steps());
  const VertexNeighbours neighbours(skin.faces, lines.size());
  level(lines, neighbours, heights);
  skin.vertices = lifted(lines, heights);
  unfold(proxy, lines, skin, heights);

  // A random walk of k passes goes about √(k/2) edges far: half an edge of the proxy.
  const int passes =
      static_cast<int>(std::min(32u, std::max(1u, lattice.steps() * lattice.steps() / 2)));
  std::vector<Vector3d> directions = vertex_normals(skin);
  smooth(directions, neighbours, passes);
  std::vector<SkinTarget> targets(lines.size());
  for (std::size_t n = 0; n < targets.size(); ++n) {
    const double length = directions[n].norm();
    targets[n] = {skin.vertices[n],
                  length > 0 ? Vector3d(directions[n] / length) : Vector3d::UnitZ()};
  }
  return targets;
}

constexpr std::size_t kPlateVertices = 24;  // that a plate runs through
constexpr double kTwist = 0.5;       // a turn of 1 rad counts as this share of its vertex's edges
constexpr double kPlateReach = 1.2;  // of its vertex's longest edge: how far a plate counts
// Smaller ones are left out: a step from node to node, which at 3e-3 creases a dent by degrees.
constexpr double kLeastWeight = 1e-3;
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
  parallel_for(std::size_t{0}, plates.size(), [&](std::size_t v) {
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

// The weights that carry the nodes, as the top of this file says.
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
  parallel_for(std::size_t{0}, targets.size(), [&](std::size_t n) {
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

}  // namespace

SmoothSkin bake_smooth_skin(const TracedSurface& surface, const TriangleMesh& proxy, double edge_mm,
                            const RunContext& context) {
  constexpr std::size_t kMostNodes = 100'000;
  if (!(edge_mm > 0) || !std::isfinite(edge_mm))
    throw UsageError("skin edge = " + to_text(edge_mm) + " mm: take a positive length");
  check_mesh(proxy, "proxy");
  if (proxy.empty()) throw BadDataError("proxy: no faces for a skin to lie over");
  const Lattice lattice(proxy, lattice_steps(proxy, edge_mm, kMostNodes));
  const std::vector<SkinTarget> targets =
      skin_targets(proxy, lattice, surface, shell_reach_mm(surface.mesh, proxy), context);
  context.throw_if_cancelled();
  return skin_weights(proxy, lattice, targets);
}

}  // namespace organbake
