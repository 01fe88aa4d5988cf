// SPDX-License-Identifier: GPL-3.0-or-later
#include "capture/skin_weights.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <queue>
#include <utility>

namespace organbake {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::size_t kPlateVertices = 24;  // that a plate runs through
// Directions in which a plate's vertices spread by less than this share of the widest carry no
// affine part: they would be extrapolated from next to nothing.
constexpr double kFlat = 0.1;
constexpr double kTwist = 0.5;         // a turn of 1 rad counts as this share of its vertex's edges
constexpr double kPlateReach = 1.2;    // of its vertex's longest edge: how far a plate counts
constexpr double kLeastWeight = 3e-3;  // a smaller one moves no node visibly

// A plate gives way to its vertices by this share of its size cubed: two of them that nearly
// coincide would otherwise bend it as if what lies between them went on.
constexpr double kYielding = 1e-4;
// Weights whose sizes sum to more than this come from vertices that say too little.
constexpr double kMostLeverage = 10;

struct Sample {
  Vector3d at, normal;
};

using VertexGraph = std::vector<std::vector<std::uint32_t>>;

VertexGraph neighbours_of(const TriangleMesh& proxy) {
  VertexGraph graph(proxy.vertices.size());
  for (const Face& f : proxy.faces) {
    for (int k = 0; k < 3; ++k) {
      graph[f[k]].push_back(f[(k + 1) % 3]);
      graph[f[k]].push_back(f[(k + 2) % 3]);
    }
  }
  for (auto& list : graph) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return graph;
}

// The vertices that lie nearest along the edges (Dijkstra 1959), the vertex itself first.
std::vector<std::uint32_t> nearest_along(const VertexGraph& graph,
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
    for (const std::uint32_t w : graph[v]) {
      if (!done[w]) open.emplace(away + (vertices[v] - vertices[w]).norm(), w);
    }
  }
  return nearest;
}

// The directions in which samples spread, the widest first, one by column.
MatrixXd wide_axes(const MatrixXd& samples, double least_spread_mm) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> principal(samples * samples.transpose() /
                                                          double(samples.cols()));
  Eigen::Index count = 0;
  const Eigen::Index all = samples.rows();
  while (count < all &&
         principal.eigenvalues()[all - 1 - count] > least_spread_mm * least_spread_mm)
    ++count;
  return principal.eigenvectors().rightCols(count);
}

// Where samples lie for a plate: along the directions in which their places spread and, beyond what
// follows from those, their normals. r³ is only fit for interpolation together with all affine
// functions of the space that r is measured in, and those need samples that spread in all of it.
class PlateSpace {
 public:
  PlateSpace() = default;
  PlateSpace(const std::vector<Sample>& samples, const Sample& center, double twist_mm)
      : center_(center) {
    const auto count = static_cast<Eigen::Index>(samples.size());
    MatrixXd places(3, count), normals(3, count);
    for (Eigen::Index k = 0; k < count; ++k) {
      places.col(k) = samples[k].at;
      normals.col(k) = twist_mm * samples[k].normal;
    }
    const Vector3d mean_place = places.rowwise().mean(), mean_normal = normals.rowwise().mean();
    places.colwise() -= mean_place;
    normals.colwise() -= mean_normal;
    const double least_mm = kFlat * std::sqrt(places.squaredNorm() / double(count));
    place_axes_ = wide_axes(places, least_mm).transpose();
    const MatrixXd along = place_axes_ * places;
    // What of the normals follows from the places, by least squares.
    const MatrixXd normal_from_place =
        normals * along.transpose() *
        (along * along.transpose()).completeOrthogonalDecomposition().pseudoInverse();
    const MatrixXd normal_axes =
        wide_axes(normals - normal_from_place * along, least_mm).transpose();
    normal_axes_ = twist_mm * normal_axes;
    place_in_normal_ = normal_axes * normal_from_place * place_axes_;
  }

  Eigen::Index dimensions() const { return place_axes_.rows() + normal_axes_.rows(); }
  VectorXd operator()(const Sample& sample) const {
    const Vector3d place = sample.at - center_.at;
    VectorXd in_space(dimensions());
    in_space.head(place_axes_.rows()) = place_axes_ * place;
    in_space.tail(normal_axes_.rows()) =
        normal_axes_ * (sample.normal - center_.normal) - place_in_normal_ * place;
    return in_space;
  }

 private:
  Sample center_;
  MatrixXd place_axes_, normal_axes_, place_in_normal_;
};

// A thin plate through some vertices.
class Plate {
 public:
  Plate() = default;
  Plate(const std::vector<Sample>& through, double twist_mm, double longest_mm)
      : center_(through.front()), twist_mm_(twist_mm), reach_mm_(kPlateReach * longest_mm) {
    for (const Sample& s : through) size_mm_ = std::max(size_mm_, (s.at - center_.at).norm());
    if (!(size_mm_ > 0)) size_mm_ = 1;
    space_ = PlateSpace(through, center_, twist_mm);
    for (const Sample& s : through) through_.push_back(space_(s) / size_mm_);
    solve();
  }

  // Fades to 0 at the plate's reach, twice continuously differentiable.
  double share(const Sample& place) const {
    const double squared_mm = (place.at - center_.at).squaredNorm() +
                              twist_mm_ * twist_mm_ * (place.normal - center_.normal).squaredNorm();
    const double t = std::sqrt(squared_mm) / reach_mm_;
    if (!(t < 1)) return 0;
    const double left = (1 - t) * (1 - t);
    return left * left * (4 * t + 1);
  }
  // Of the vertices, in the order given; they sum to 1.
  VectorXd weights(const Sample& place) const {
    return inverse_.topRows(static_cast<Eigen::Index>(through_.size())) *
           functions(space_(place) / size_mm_);
  }

 private:
  // The kernel about each vertex, then the affine functions.
  VectorXd functions(const VectorXd& place) const {
    const auto count = static_cast<Eigen::Index>(through_.size());
    VectorXd values(count + 1 + place.size());
    for (Eigen::Index k = 0; k < count; ++k) {
      const double r2 = (place - through_[k]).squaredNorm();
      values[k] = r2 * std::sqrt(r2);
    }
    values[count] = 1;
    values.tail(place.size()) = place;
    return values;
  }

  void solve() {
    const auto count = static_cast<Eigen::Index>(through_.size());
    const Eigen::Index all = count + 1 + space_.dimensions();
    MatrixXd equations = MatrixXd::Zero(all, all);
    for (Eigen::Index k = 0; k < count; ++k) {
      const VectorXd values = functions(through_[k]);
      equations.col(k) = values;
      equations.row(k) = values.transpose();
    }
    for (Eigen::Index k = 0; k < count; ++k) equations(k, k) += kYielding;
    // Ranks may be short: fewer vertices than affine functions, or vertices in one place.
    inverse_ = equations.completeOrthogonalDecomposition().pseudoInverse();
  }

  Sample center_;
  double twist_mm_ = 0, reach_mm_ = 0, size_mm_ = 0;
  PlateSpace space_;
  std::vector<VectorXd> through_;  // in the plate's space, in sizes
  MatrixXd inverse_;
};

struct PlateOfVertex {
  std::vector<std::uint32_t> through;
  Plate plate;
};

std::vector<PlateOfVertex> make_plates(const TriangleMesh& proxy,
                                       const std::vector<Sample>& samples) {
  const VertexGraph graph = neighbours_of(proxy);
  std::vector<PlateOfVertex> plates(proxy.vertices.size());
  tbb::parallel_for(std::size_t{0}, plates.size(), [&](std::size_t v) {
    const auto vertex = static_cast<std::uint32_t>(v);
    plates[v].through = nearest_along(graph, proxy.vertices, vertex, kPlateVertices);
    double sum_mm = 0, longest_mm = 0;
    for (const std::uint32_t w : graph[v]) {
      const double edge_mm = (proxy.vertices[v] - proxy.vertices[w]).norm();
      sum_mm += edge_mm;
      longest_mm = std::max(longest_mm, edge_mm);
    }
    const double edge_mm = graph[v].empty() ? 0 : sum_mm / double(graph[v].size());
    std::vector<Sample> through;
    for (const std::uint32_t w : plates[v].through) through.push_back(samples[w]);
    plates[v].plate = Plate(through, kTwist * edge_mm, longest_mm);
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

Carriers carriers_of(const Sample& node, const NodePlace& place, const TriangleMesh& proxy,
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
    return Sample{at, targets[node].normal};
  };
  std::vector<Sample> vertices;  // they are the first nodes
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
