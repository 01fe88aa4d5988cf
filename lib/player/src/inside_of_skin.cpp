// SPDX-License-Identifier: Apache-2.0
// What the inside of an organ does when its skin alone is known: membrane energy (Botsch and
// Sorkine 2008, "On linear variational surface deformation methods", 3.1, in a volume), which has
// no parameter that tissue would have to tell. By conjugate gradients without a matrix (Hestenes
// and Stiefel 1952): it is asked for once, when a step follows a state, and stays small in a page.
#include "inside_of_skin.h"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace organbake {
namespace {

using Vectors = std::vector<Eigen::Vector3d>;

// Of an edge of a tetrahedron, against 1 of a vertex: skin is met to a thousandth of its motion.
constexpr double kSmooth = 1e-4;
constexpr int kMostRounds = 400;
constexpr double kSmallest = 1e-10;  // of what is left of the residual's square

void hold_anchors(const TetrahedralBody& body, Vectors& rows) {
  for (const std::uint32_t anchor : body.anchors) rows[anchor].setZero();
}

// Wᵀ times rows of the vertices, added up by node.
void spread(const TetrahedralBody& body, const auto& row_of_vertex, Vectors& rows) {
  for (std::size_t v = 0; v < body.vertices.size(); ++v) {
    const Eigen::Vector3d row = row_of_vertex(v);
    each_carrier(body, v, [&](std::uint32_t node, double weight) { rows[node] += weight * row; });
  }
}

Eigen::Vector3d carried(const TetrahedralBody& body, std::size_t vertex, const Vectors& u) {
  Eigen::Vector3d moved = Eigen::Vector3d::Zero();
  each_carrier(body, vertex, [&](std::uint32_t node, double weight) { moved += weight * u[node]; });
  return moved;
}

// (WᵀW + ε L) u, anchors' rows 0.
void apply(const TetrahedralBody& body, const Vectors& u, Vectors& result) {
  std::fill(result.begin(), result.end(), Eigen::Vector3d::Zero());
  spread(
      body, [&](std::size_t v) { return carried(body, v, u); }, result);
  for (const Tetrahedron& t : body.tetrahedra) {
    const Eigen::Vector3d sum = u[t.nodes[0]] + u[t.nodes[1]] + u[t.nodes[2]] + u[t.nodes[3]];
    for (const std::uint32_t n : t.nodes) result[n] += kSmooth * (4 * u[n] - sum);
  }
  hold_anchors(body, result);
}

double dot(const Vectors& a, const Vectors& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

void add(double scale, const Vectors& from, Vectors& to) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] += scale * from[i];
}

}  // namespace

void carry_vertices(const TetrahedralBody& body, const std::vector<Eigen::Vector3d>& rest_mm,
                    const std::vector<Eigen::Vector3d>& nodes_mm,
                    std::vector<Eigen::Vector3d>& vertices_mm) {
  vertices_mm.resize(rest_mm.size());
  for (std::size_t v = 0; v < rest_mm.size(); ++v) {
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    each_carrier(body, v, [&](std::uint32_t node, double weight) {
      moved += weight * (nodes_mm[node] - body.nodes_mm[node]);
    });
    vertices_mm[v] = rest_mm[v] + moved;
  }
}

std::vector<Eigen::Vector3d> nodes_under(const TetrahedralBody& body,
                                         const std::vector<Eigen::Vector3d>& rest_mm,
                                         const std::vector<Eigen::Vector3d>& vertices_mm) {
  const std::size_t count = body.nodes_mm.size();
  Vectors u(count, Eigen::Vector3d::Zero()), residual = u, product = u;
  spread(
      body, [&](std::size_t v) -> Eigen::Vector3d { return vertices_mm[v] - rest_mm[v]; },
      residual);
  hold_anchors(body, residual);
  Vectors along = residual;
  double left = dot(residual, residual);
  const double enough = kSmallest * left;
  for (int round = 0; round < kMostRounds && left > enough; ++round) {
    apply(body, along, product);
    const double step = left / dot(along, product);
    add(step, along, u);
    add(-step, product, residual);
    const double before = std::exchange(left, dot(residual, residual));
    for (std::size_t n = 0; n < count; ++n) along[n] = residual[n] + left / before * along[n];
  }
  add(1, body.nodes_mm, u);
  return u;
}

}  // namespace organbake
