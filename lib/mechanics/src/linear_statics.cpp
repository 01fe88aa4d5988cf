// SPDX-License-Identifier: GPL-3.0-or-later
// Linear elasticity on tetrahedra of constant strain by sparse Cholesky: the reference that springs
// are fitted to, and measured against.
#include "organbake/mechanics/linear_statics.h"

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>

#include "organbake/core/error.h"

namespace organbake {
namespace {

using Triplets = std::vector<Eigen::Triplet<double>>;

constexpr double kRoundingPivot = 1e-12;        // of the largest
constexpr double kNewtonPerMilliNewton = 1e-3;  // 1 kPa is 1 mN/mm²

// −1 for anchors.
std::vector<Eigen::Index> number_points(std::size_t points,
                                        const std::vector<std::uint32_t>& anchors,
                                        Eigen::Index& count) {
  std::vector<Eigen::Index> number(points, 0);
  for (const std::uint32_t a : anchors) number[a] = -1;
  count = 0;
  for (Eigen::Index& n : number) {
    if (n >= 0) n = count++;
  }
  return number;
}

// V (λ ∇a ∇bᵀ + μ ∇b ∇aᵀ + μ ∇a·∇b 1): isotropic linear elasticity, N/mm.
void add_element(const MechanicsModel& model, const Tetrahedron& t,
                 const std::vector<Eigen::Index>& number, Triplets& entries) {
  const TetrahedralBody& body = *model.body;
  const Eigen::Matrix<double, 4, 3> gradients = gradients_of(body, t);
  const double e = kNewtonPerMilliNewton * model.young_modulus_kpa, nu = body.poisson_ratio;
  const double volume = t.fill * volume_of(body, t);
  const double mu = volume * e / (2 * (1 + nu));
  const double lambda = volume * e * nu / ((1 + nu) * (1 - 2 * nu));
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < 4; ++b) {
      const Eigen::Index i = number[t.nodes[a]], j = number[t.nodes[b]];
      if (i < 0 || j < 0) continue;
      const Eigen::RowVector3d ga = gradients.row(a), gb = gradients.row(b);
      const Eigen::Matrix3d block = lambda * ga.transpose() * gb + mu * gb.transpose() * ga +
                                    mu * ga.dot(gb) * Eigen::Matrix3d::Identity();
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) entries.emplace_back(3 * i + r, 3 * j + c, block(r, c));
    }
  }
}

// Vertex coordinates by the free nodes' coordinates.
Eigen::SparseMatrix<double> embedding_of(const TetrahedralBody& body,
                                         const std::vector<Eigen::Index>& number,
                                         Eigen::Index count) {
  Triplets entries;
  for (std::size_t v = 0; v < body.vertices.size(); ++v) {
    each_carrier(body, v, [&](std::uint32_t node, double weight) {
      const Eigen::Index i = number[node];
      if (i < 0) return;
      for (int axis = 0; axis < 3; ++axis) entries.emplace_back(3 * v + axis, 3 * i + axis, weight);
    });
  }
  Eigen::SparseMatrix<double> matrix(static_cast<Eigen::Index>(3 * body.vertices.size()),
                                     3 * count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace

Eigen::MatrixXd fem_displacements(const MechanicsModel& model, const Eigen::MatrixXd& loads_n) {
  if (!model.body) throw BadDataError("the mechanics have no tetrahedra");
  const TetrahedralBody& body = *model.body;
  Eigen::Index count = 0;
  const auto number = number_points(body.nodes_mm.size(), body.anchors, count);
  Triplets entries;
  for (const Tetrahedron& t : body.tetrahedra) add_element(model, t, number, entries);
  Eigen::SparseMatrix<double> stiffness(3 * count, 3 * count);
  stiffness.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(stiffness);
  // A hinge leaves pivots of rounding, of either sign.
  if (count == 0 || factor.info() != Eigen::Success ||
      !(factor.vectorD().minCoeff() > kRoundingPivot * factor.vectorD().maxCoeff()))
    throw BadDataError("the tetrahedra can move as a whole: nothing holds some part of them");
  const Eigen::SparseMatrix<double> embedding = embedding_of(body, number, count);
  return embedding * factor.solve(Eigen::MatrixXd(embedding.transpose() * loads_n));
}

LinearSprings::LinearSprings(const TriangleMesh& proxy, const MechanicsModel& model)
    : proxy_(proxy), model_(model) {
  free_of_vertex_ = number_points(proxy.vertices.size(), model.anchors, free_count_);
  for (std::size_t s = 0; s < model.springs.size(); ++s) {
    const Spring& spring = model.springs[s];
    if (free_of_vertex_[spring.a] >= 0 || free_of_vertex_[spring.b] >= 0) springs_.push_back(s);
  }
  const auto count = static_cast<Eigen::Index>(springs_.size());
  stretch_ = Eigen::MatrixXd::Zero(3 * free_count_, count);
  stiffness_.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Spring& spring = model.springs[springs_[i]];
    stiffness_[i] = spring.stiffness_n_per_mm;
    const Eigen::Vector3d along =
        (proxy.vertices[spring.b] - proxy.vertices[spring.a]).normalized();
    const Eigen::Index a = free_of_vertex_[spring.a], b = free_of_vertex_[spring.b];
    if (a >= 0) stretch_.block<3, 1>(3 * a, i) = -along;
    if (b >= 0) stretch_.block<3, 1>(3 * b, i) = along;
  }
  Eigen::MatrixXd gradient = Eigen::MatrixXd::Zero(3 * proxy.vertices.size(), 1);
  const Eigen::Vector3d center = bounds(proxy).center();
  for (const Face& f : proxy.faces) {
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d p = proxy.vertices[f[(k + 1) % 3]] - center;
      const Eigen::Vector3d q = proxy.vertices[f[(k + 2) % 3]] - center;
      gradient.block<3, 1>(3 * f[k], 0) += p.cross(q) / 6;
    }
  }
  volume_gradient_ = free_rows(gradient);
}

// (K + ∇V ∇Vᵀ/c)⁻¹, c the volume's compliance; for a kept volume c = 0.
Eigen::MatrixXd LinearSprings::compliance(const Eigen::VectorXd& scales) const {
  const Eigen::VectorXd stiffness = stiffness_.cwiseProduct(scales);
  const Eigen::MatrixXd matrix = stretch_ * stiffness.asDiagonal() * stretch_.transpose();
  const Eigen::LLT<Eigen::MatrixXd> factor(matrix);
  const Eigen::VectorXd pivots = factor.matrixLLT().diagonal().cwiseAbs2();
  if (pivots.size() == 0 || factor.info() != Eigen::Success ||
      !(pivots.minCoeff() > kRoundingPivot * pivots.maxCoeff()))
    throw BadDataError("the springs leave the proxy some motion that stretches none of them");
  Eigen::MatrixXd compliance =
      factor.solve(Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()));
  const double s = model_.volume_stiffness;
  if (s <= 0) return compliance;
  double bulk = 0;  // as the player has it: deform/enclosed_volume.h
  for (const Spring& spring : model_.springs)
    bulk += spring.stiffness_n_per_mm * spring.rest_length_mm * spring.rest_length_mm / 9;
  const double volume = signed_volume(proxy_);
  const double soft = volume * volume / bulk * (1 - s) / s;
  const Eigen::VectorXd swell = compliance * volume_gradient_;
  compliance -= swell * swell.transpose() / (volume_gradient_.dot(swell) + soft);
  return compliance;
}

Eigen::MatrixXd LinearSprings::free_rows(const Eigen::MatrixXd& all) const {
  Eigen::MatrixXd free(3 * free_count_, all.cols());
  for (std::size_t v = 0; v < free_of_vertex_.size(); ++v) {
    const Eigen::Index i = free_of_vertex_[v];
    if (i >= 0) free.middleRows<3>(3 * i) = all.middleRows<3>(3 * v);
  }
  return free;
}

Eigen::MatrixXd LinearSprings::all_rows(const Eigen::MatrixXd& free) const {
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(3 * free_of_vertex_.size(), free.cols());
  for (std::size_t v = 0; v < free_of_vertex_.size(); ++v) {
    const Eigen::Index i = free_of_vertex_[v];
    if (i >= 0) all.middleRows<3>(3 * v) = free.middleRows<3>(3 * i);
  }
  return all;
}

}  // namespace organbake
