// SPDX-License-Identifier: Apache-2.0
// The surface that carries the shell: the proxy's own faces, or the smooth skin on lattices over
// them, with deformation gradients at its vertices: by least squares over the edges that meet
// there. The fit is of second order: a first-order one over an uneven ring would take the ring's
// curvature for a slope of the surface.
#include "organbake/geometry/shell.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/mesh_edges.h"
#include "organbake/geometry/smooth_skin.h"
#include "organbake/geometry/vertex_gradients.h"

namespace organbake {

// Nodes in order: the vertices, then each edge's, then each face's inner ones.
Lattice::Lattice(const TriangleMesh& proxy, std::uint32_t steps)
    : proxy_(proxy), steps_(steps), face_count_(static_cast<std::uint32_t>(proxy.faces.size())) {
  const auto each_side = [&](const auto& visit) {
    for (std::uint32_t side = 0; side < 3 * face_count_; ++side) {
      const Face& face = proxy.faces[side / 3];
      visit(edge_key(face[side % 3], face[(side + 1) % 3]), side);
    }
  };
  // By their lower vertices, and of each, which has few, by the higher ones.
  std::vector<std::uint32_t> first(proxy.vertices.size() + 1, 0);
  each_side([&](std::uint64_t ends, std::uint32_t) { ++first[(ends >> 32) + 1]; });
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<std::pair<std::uint64_t, std::uint32_t>> sides(3 * proxy.faces.size());
  std::vector<std::uint32_t> next = first;
  each_side([&](std::uint64_t ends, std::uint32_t side) {
    sides[next[ends >> 32]++] = {ends, side};
  });
  for (std::size_t v = 0; v + 1 < first.size(); ++v)
    std::sort(sides.begin() + first[v], sides.begin() + first[v + 1]);
  face_edges_.resize(proxy.faces.size());
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const auto& [ends, side] = sides[i];
    if (i == 0 || ends != sides[i - 1].first)
      edges_.push_back({static_cast<std::uint32_t>(ends >> 32), static_cast<std::uint32_t>(ends)});
    face_edges_[side / 3][side % 3] = static_cast<std::uint32_t>(edges_.size() - 1);
  }
  first_inner_ = static_cast<std::uint32_t>(proxy.vertices.size() + edges_.size() * (steps_ - 1));
}

// from_first: steps away from the face's own first corner of that edge, 1 … steps − 1.
std::uint32_t Lattice::on_edge(std::uint32_t face, int edge, std::uint32_t from_first) const {
  const std::uint32_t index = face_edges_[face][edge];
  const bool same_way = proxy_.faces[face][edge] == edges_[index][0];
  const std::uint32_t from_lower = same_way ? from_first : steps_ - from_first;
  return static_cast<std::uint32_t>(proxy_.vertices.size()) + index * (steps_ - 1) + from_lower - 1;
}

std::uint32_t Lattice::node(std::uint32_t face, std::uint32_t i, std::uint32_t j) const {
  const std::uint32_t k = steps_ - i - j;  // b0
  const Face& corners = proxy_.faces[face];
  if (k == steps_) return corners[0];
  if (i == steps_) return corners[1];
  if (j == steps_) return corners[2];
  if (j == 0) return on_edge(face, 0, i);
  if (k == 0) return on_edge(face, 1, j);
  if (i == 0) return on_edge(face, 2, k);
  // Inner rows i = 1 … steps − 2 hold steps − 1 − i nodes each.
  const std::uint32_t before = (i - 1) * (steps_ - 1) - (i - 1) * i / 2;
  return first_inner_ + face * inner_per_face() + before + j - 1;
}

std::vector<Lattice::ShellLine> Lattice::shell_lines() const {
  const std::vector<Eigen::Vector3d> normals = vertex_normals(proxy_);
  std::vector<ShellLine> lines;
  lines.reserve(node_count());
  for (std::size_t v = 0; v < proxy_.vertices.size(); ++v)
    lines.push_back({proxy_.vertices[v], normals[v]});
  for (const auto& [a, b] : edges_)
    for (std::uint32_t s = 1; s < steps_; ++s) {
      const double share = double(s) / steps_;
      lines.push_back({(1 - share) * proxy_.vertices[a] + share * proxy_.vertices[b],
                       (1 - share) * normals[a] + share * normals[b]});
    }
  for (const auto& [a, b, c] : proxy_.faces)
    for (std::uint32_t i = 1; i + 1 < steps_; ++i)
      for (std::uint32_t j = 1; i + j < steps_; ++j) {
        const double b1 = double(i) / steps_, b2 = double(j) / steps_, b0 = 1 - b1 - b2;
        lines.push_back(
            {b0 * proxy_.vertices[a] + b1 * proxy_.vertices[b] + b2 * proxy_.vertices[c],
             b0 * normals[a] + b1 * normals[b] + b2 * normals[c]});
      }
  return lines;
}

std::uint32_t lattice_steps(const TriangleMesh& proxy, double step_mm, std::size_t max_nodes) {
  constexpr double kMostSteps = 64;
  const double wanted = std::round(mean_edge_length(proxy) / step_mm);
  auto steps = static_cast<std::uint32_t>(std::clamp(wanted, 1.0, kMostSteps));
  while (steps > 1 && proxy.faces.size() * ((steps + 1) * (steps + 2) / 2) > max_nodes) --steps;
  return steps;
}

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

using Matrix5d = Eigen::Matrix<double, 5, 5>;
using Vector5d = Eigen::Matrix<double, 5, 1>;

// The edges of a vertex span its tangent plane by this share of what they would if they stood at
// right angles.
constexpr double kLeastSpan = 1e-6;
// Curvature is not told apart from slope by few edges: it is held back by this share of theirs.
constexpr double kHeldBack = 1e-3;
// An edge that is bent by less than this share of its length stays straight, as where a gradient is
// not known: that is 0.4° from end to end. A poke stirs all of an organ, and flat faces are drawn
// faster. Nor does it turn by more than a right angle, whatever a fold does to the gradients.
constexpr double kLeastBend = 1.0 / 300;

// Two directions across a unit normal.
std::array<Vector3d, 2> across(const Vector3d& normal) {
  const Vector3d one = normal.unitOrthogonal();
  return {one, normal.cross(one)};
}

// What of each edge the slope takes: A⁻¹ m of the fit δ ≈ G (s, t) + Q (s², s t, t²), in the
// tangent plane. Without the curvature Q an uneven ring of edges would take it for slope.
std::vector<Vector3d> slope_weights(std::span<const Vector3d> edges_mm, const Vector3d& normal) {
  const auto [one, other] = across(normal);
  double length2 = 0;
  for (const Vector3d& edge : edges_mm) length2 += edge.squaredNorm();
  const double length = std::sqrt(length2 / double(std::max<std::size_t>(1, edges_mm.size())));
  std::vector<Vector5d> rows;
  Matrix5d sum = Matrix5d::Zero();
  for (const Vector3d& edge : edges_mm) {
    const double s = edge.dot(one) / length, t = edge.dot(other) / length;
    rows.push_back(Vector5d(s, t, s * s, s * t, t * t));
    sum += rows.back() * rows.back().transpose();
  }
  const double mean = 0.5 * (sum(0, 0) + sum(1, 1));
  const bool spans = sum.topLeftCorner<2, 2>().determinant() > kLeastSpan * mean * mean;
  sum.diagonal().tail<3>().array() += kHeldBack * mean;
  const Matrix5d inverse = spans ? Matrix5d(sum.inverse())
                                 : Matrix5d::Constant(std::numeric_limits<double>::quiet_NaN());
  std::vector<Vector3d> weights;
  for (const Vector5d& row : rows) {
    const Eigen::Vector2d slope = inverse.topRows<2>() * row / length;
    weights.push_back(slope[0] * one + slope[1] * other);
  }
  return weights;
}

}  // namespace

VertexGradients::VertexGradients(const TriangleMesh& rest)
    : neighbours_(rest.faces, rest.vertices.size()), first_{0} {
  const std::vector<Vector3d> normals = vertex_normals(rest);
  std::vector<Vector3d> edges;
  for (std::uint32_t v = 0; v < rest.vertices.size(); ++v) {
    edges.clear();
    for (const std::uint32_t other : neighbours_.of(v))
      edges.push_back(rest.vertices[other] - rest.vertices[v]);
    const std::vector<Vector3d> weights = slope_weights(edges, normals[v]);
    // The normal is turned into what it is now; so much of each edge follows it.
    Vector3d hub = normals[v];
    for (std::size_t k = 0; k < edges.size(); ++k) {
      spokes_.push_back({edges[k], weights[k]});
      hub -= edges[k].dot(normals[v]) * weights[k];
    }
    hubs_.push_back({normals[v], hub});
    first_.push_back(static_cast<std::uint32_t>(spokes_.size()));
  }
}

Matrix3d VertexGradients::change(std::uint32_t vertex, const std::vector<Vector3d>& positions,
                                 const std::vector<Vector3d>& normals) const {
  const Hub& hub = hubs_[vertex];
  Matrix3d change = (normals[vertex] - hub.normal) * hub.weight.transpose();
  const Spoke* spoke = &spokes_[first_[vertex]];
  for (const std::uint32_t other : neighbours_.of(vertex)) {
    const Vector3d moved = positions[other] - positions[vertex] - spoke->edge_mm;
    change += moved * spoke->weight.transpose();
    ++spoke;
  }
  return change;
}

void bend_face(const TriangleMesh& rest, std::uint32_t face, const std::vector<Matrix3d>& changes,
               ShellMatrix& shell) {
  const Face& f = rest.faces[face];
  const auto edge = [&](int i, int j, const Vector3d& chord_mm) -> Vector3d {
    const Vector3d e =
        0.5 * (changes[f[i]] - changes[f[j]]) * (rest.vertices[f[j]] - rest.vertices[f[i]]);
    const double share2 = e.squaredNorm() / chord_mm.squaredNorm();
    if (!(share2 > kLeastBend * kLeastBend)) return Vector3d::Zero();
    return share2 <= 1 ? e : Vector3d(e / std::sqrt(share2));
  };
  const Vector3d e01 = edge(0, 1, shell.col(1)), e02 = edge(0, 2, shell.col(2)),
                 e12 = edge(1, 2, shell.col(2) - shell.col(1));
  // Σ b_i b_j e_ij with b_0 = 1 − b_1 − b_2.
  shell.col(1) += e01;
  shell.col(2) += e02;
  shell.col(6) = -e01;
  shell.col(7) = e12 - e01 - e02;
  shell.col(8) = -e02;
}

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
  if (skin.node_count() != lattice.node_count())
    fail("holds " + std::to_string(skin.node_count()) + " nodes where " +
         std::to_string(skin.steps) + " steps over this proxy have " +
         std::to_string(lattice.node_count()));
  if (skin.first.front() != 0 || skin.first.back() != skin.carrier.size() ||
      skin.carrier.size() != skin.weight.size())
    fail("its carriers and weights are not of one number");
  for (std::size_t n = 0; n < skin.node_count(); ++n) {
    if (skin.first[n] >= skin.first[n + 1]) fail("node " + std::to_string(n) + " has no carriers");
    double sum = 0;
    for (std::uint32_t k = skin.first[n]; k < skin.first[n + 1]; ++k) {
      if (skin.carrier[k] >= proxy.vertices.size())
        fail("node " + std::to_string(n) + " is carried by vertex " +
             std::to_string(skin.carrier[k]) + ", which the proxy does not have");
      if (!(std::abs(skin.weight[k]) <= kMostWeight))
        fail("node " + std::to_string(n) + " has a weight that no smooth skin has");
      sum += skin.weight[k];
    }
    if (!(std::abs(sum - 1) <= kSumWithin))
      fail("the weights of node " + std::to_string(n) + " do not sum to 1");
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

ShellSurface::ShellSurface(TriangleMesh proxy, std::optional<SmoothSkin> skin)
    : proxy_(std::move(proxy)), skin_(std::move(skin)) {
  proxy_.colors.clear();
  if (skin_) check_smooth_skin(*skin_, proxy_, "smooth skin");
  rest_ = skin_ ? smooth_skin_mesh(proxy_, *skin_) : proxy_;
}

void ShellSurface::pose(const std::vector<Eigen::Vector3d>& proxy_positions,
                        std::vector<Eigen::Vector3d>& positions) const {
  if (skin_) {
    carry(*skin_, proxy_positions, positions);
  } else {
    positions = proxy_positions;
  }
}

double ShellSurface::reach_mm() const {
  // Any height may occur over a coarse proxy; half the organ is beyond all of them and keeps the
  // search bounded. A skin follows the surface.
  return (skin_ ? 0.05 : 0.5) * bounds(rest_).diagonal();
}

TriangleMesh ShellSurface::posed(const std::vector<Eigen::Vector3d>& proxy_positions) const {
  TriangleMesh mesh;
  mesh.faces = rest_.faces;
  pose(proxy_positions, mesh.vertices);
  return mesh;
}

std::vector<ShellMatrix> ShellSurface::posed_matrices(
    const std::vector<Eigen::Vector3d>& proxy_positions) const {
  const TriangleMesh mesh = posed(proxy_positions);
  if (!skin_) return shell_matrices(mesh);
  const VertexGradients gradients(rest_);
  const std::vector<Eigen::Vector3d> normals = vertex_normals(mesh);
  std::vector<Eigen::Matrix3d> changes(mesh.vertices.size());
  for (std::uint32_t v = 0; v < changes.size(); ++v)
    changes[v] =
        skin_->is_creased(v) ? unknown_change() : gradients.change(v, mesh.vertices, normals);
  std::vector<ShellMatrix> matrices(mesh.faces.size());
  for (std::uint32_t f = 0; f < matrices.size(); ++f) {
    matrices[f] = shell_matrix(mesh, normals, f);
    bend_face(rest_, f, changes, matrices[f]);
  }
  return matrices;
}

}  // namespace organbake
