// SPDX-License-Identifier: GPL-3.0-or-later
// Normal equations of a Gauss–Newton step over all vertices of a proxy, as a sparse matrix of 3 × 3
// blocks, factored by Cholesky. A kept volume is one linear constraint on the step, met by one more
// solve.
#include "fit_equations.h"

#include <Eigen/SparseCholesky>
#include <cmath>

namespace organbake {

struct FitEquations::Solver {
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> cholesky;
  bool analysed = false;
};

FitEquations::FitEquations(const std::vector<Face>& faces, std::size_t vertices)
    : faces_(faces), vertices_(vertices), sums_(faces.size()), solver_(std::make_unique<Solver>()) {
  clear();
}

FitEquations::~FitEquations() = default;

void FitEquations::clear() {
  for (FaceSums& sums : sums_) {
    sums.blocks.fill(Eigen::Matrix3d::Zero());
    sums.right.fill(Eigen::Vector3d::Zero());
  }
}

void FitEquations::add(std::uint32_t face, const Eigen::Vector3d& weights, const FitTerm& term) {
  FaceSums& sums = sums_[face];
  int block = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) sums.blocks[block++] += (weights[i] * weights[j]) * term.matrix;
    sums.right[i] += weights[i] * term.right;
  }
}

std::vector<Eigen::Vector3d> FitEquations::solve(
    const std::vector<Eigen::Vector3d>& volume_gradient, double volume_change) {
  // Vertices that no sample speaks for must not make the matrix singular.
  constexpr double kDamping = 1e-4;  // of the mean diagonal
  const auto n = static_cast<Eigen::Index>(3 * vertices_);
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(81 * faces_.size() / 2 + n);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  double trace = 0;
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    int block = 0;
    for (int i = 0; i < 3; ++i) {
      right.segment<3>(3 * faces_[f][i]) += sums_[f].right[i];
      for (int j = i; j < 3; ++j, ++block) {
        // The lower triangle only: that is what the factorisation reads.
        const std::uint32_t row = std::max(faces_[f][i], faces_[f][j]);
        const std::uint32_t column = std::min(faces_[f][i], faces_[f][j]);
        for (int r = 0; r < 3; ++r) {
          for (int c = 0; c < (i == j ? r + 1 : 3); ++c) {
            entries.emplace_back(3 * row + r, 3 * column + c, sums_[f].blocks[block](r, c));
          }
        }
        if (i == j) trace += sums_[f].blocks[block].trace();
      }
    }
  }
  for (Eigen::Index i = 0; i < n; ++i) entries.emplace_back(i, i, kDamping * trace / double(n));
  Eigen::SparseMatrix<double> matrix(n, n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  if (!solver_->analysed) solver_->cholesky.analyzePattern(matrix);
  solver_->analysed = true;
  solver_->cholesky.factorize(matrix);
  if (!(trace > 0) || solver_->cholesky.info() != Eigen::Success) return {};

  Eigen::VectorXd step = solver_->cholesky.solve(right);
  if (!volume_gradient.empty()) {
    const Eigen::Map<const Eigen::VectorXd> gradient(volume_gradient.front().data(), n);
    const Eigen::VectorXd direction = solver_->cholesky.solve(gradient);
    const double curvature = gradient.dot(direction);
    if (curvature > 0) step += (volume_change - gradient.dot(step)) / curvature * direction;
  }
  if (!step.allFinite()) return {};
  std::vector<Eigen::Vector3d> result(vertices_);
  for (std::size_t v = 0; v < vertices_; ++v) {
    result[v] = step.segment<3>(static_cast<Eigen::Index>(3 * v));
  }
  return result;
}

}  // namespace organbake
