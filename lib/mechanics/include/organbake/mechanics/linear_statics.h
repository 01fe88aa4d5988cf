// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/bundle/mechanics_model.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Displacements (mm) of the proxy's vertices under dead loads (N), each column x, y, z by vertex:
// linear elasticity on the model's tetrahedra, for small displacements. Throws BadDataError when
// nothing holds the body.
Eigen::MatrixXd fem_displacements(const MechanicsModel& model, const Eigen::MatrixXd& loads_n);

// The springs of a model about their rest shape, its volume kept as far as the model says.
class LinearSprings {
 public:
  // Keeps both by reference. Springs between anchors have no part in it.
  LinearSprings(const TriangleMesh& proxy, const MechanicsModel& model);

  // mm per N of the free coordinates, with springs `scales` times as stiff; throws BadDataError
  // when the springs hold some motion by nothing.
  Eigen::MatrixXd compliance(const Eigen::VectorXd& scales) const;
  // Column i: ∂(length of spring i) by the free coordinates.
  const Eigen::MatrixXd& stretch() const { return stretch_; }
  const Eigen::VectorXd& stiffness_n_per_mm() const { return stiffness_; }
  const std::vector<std::size_t>& springs() const { return springs_; }  // of the model, by column

  // Rows of the free coordinates out of, and back into (anchors: 0), rows of all.
  Eigen::MatrixXd free_rows(const Eigen::MatrixXd& all) const;
  Eigen::MatrixXd all_rows(const Eigen::MatrixXd& free) const;

 private:
  const TriangleMesh& proxy_;
  const MechanicsModel& model_;
  std::vector<Eigen::Index> free_of_vertex_;  // −1: an anchor
  Eigen::Index free_count_ = 0;
  std::vector<std::size_t> springs_;
  Eigen::MatrixXd stretch_;
  Eigen::VectorXd stiffness_;
  Eigen::VectorXd volume_gradient_;  // mm², of the free coordinates
};

}  // namespace organbake
