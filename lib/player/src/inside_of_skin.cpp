// SPDX-License-Identifier: Apache-2.0
// What the inside of an organ does when its skin alone is known: membrane energy (Botsch and
// Sorkine 2008, "On linear variational surface deformation methods", 3.1, in a volume), which takes
// one sparse factor and has no parameter that tissue would have to tell.
#include "inside_of_skin.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>

#include "organbake/core/error.h"

namespace organbake {
namespace {

using Matrix = Eigen::SparseMatrix<double>;
using Rows = Eigen::Matrix<double, Eigen::Dynamic, 3>;

// Of an edge, against 1 of a vertex: skin is met to a thousandth of what it moved.
constexpr double kSmooth = 1e-4;

struct System {
  std::vector<Eigen::Triplet<double>> entries;
  const std::vector<std::uint8_t>& anchored;

  void add(std::uint32_t row, std::uint32_t column, double value) {
    if (!anchored[row] && !anchored[column]) entries.emplace_back(row, column, value);
  }
};

Matrix matrix_of(const TetrahedralBody& body, const std::vector<std::uint8_t>& anchored) {
  System system{{}, anchored};
  for (const EmbeddedVertex& v : body.vertices) {
    const auto& nodes = body.tetrahedra[v.tetrahedron].nodes;
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) system.add(nodes[a], nodes[b], v.weights[a] * v.weights[b]);
  }
  for (const Tetrahedron& t : body.tetrahedra) {
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b)
        system.add(t.nodes[a], t.nodes[b], a == b ? 3 * kSmooth : -kSmooth);
  }
  const auto count = static_cast<Eigen::Index>(anchored.size());
  for (std::uint32_t n = 0; n < anchored.size(); ++n)
    if (anchored[n]) system.entries.emplace_back(n, n, 1);
  Matrix matrix(count, count);
  matrix.setFromTriplets(system.entries.begin(), system.entries.end());
  return matrix;
}

}  // namespace

void carry_vertices(const TetrahedralBody& body, const std::vector<Eigen::Vector3d>& rest_mm,
                    const std::vector<Eigen::Vector3d>& nodes_mm,
                    std::vector<Eigen::Vector3d>& vertices_mm) {
  vertices_mm.resize(rest_mm.size());
  for (std::size_t v = 0; v < rest_mm.size(); ++v) {
    const auto& [tetrahedron, weights] = body.vertices[v];
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    for (int k = 0; k < 4; ++k) {
      const std::uint32_t node = body.tetrahedra[tetrahedron].nodes[k];
      moved += weights[k] * (nodes_mm[node] - body.nodes_mm[node]);
    }
    vertices_mm[v] = rest_mm[v] + moved;
  }
}

std::vector<Eigen::Vector3d> nodes_under(const TetrahedralBody& body,
                                         const std::vector<Eigen::Vector3d>& rest_mm,
                                         const std::vector<Eigen::Vector3d>& vertices_mm) {
  std::vector<std::uint8_t> anchored(body.nodes_mm.size(), 0);
  for (const std::uint32_t anchor : body.anchors) anchored[anchor] = 1;
  Rows pulls = Rows::Zero(static_cast<Eigen::Index>(anchored.size()), 3);
  for (std::size_t v = 0; v < rest_mm.size(); ++v) {
    const auto& [tetrahedron, weights] = body.vertices[v];
    const Eigen::RowVector3d moved = (vertices_mm[v] - rest_mm[v]).transpose();
    for (int k = 0; k < 4; ++k) {
      const std::uint32_t node = body.tetrahedra[tetrahedron].nodes[k];
      if (!anchored[node]) pulls.row(node) += weights[k] * moved;
    }
  }
  const Eigen::SimplicialLDLT<Matrix> factor(matrix_of(body, anchored));
  const Rows moved = factor.solve(pulls);
  if (factor.info() != Eigen::Success || !moved.allFinite())
    throw BadDataError("the tetrahedra do not hang together: no inside fits the skin");
  std::vector<Eigen::Vector3d> nodes = body.nodes_mm;
  for (std::size_t n = 0; n < nodes.size(); ++n)
    nodes[n] += moved.row(static_cast<Eigen::Index>(n)).transpose();
  return nodes;
}

}  // namespace organbake
