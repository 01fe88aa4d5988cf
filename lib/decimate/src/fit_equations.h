// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "fit_term.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The normal equations of one Gauss–Newton step for all of a proxy's vertices: sparse, 3 × 3
// blocks. Faces stay the same from step to step, so the pattern is analysed once.
class FitEquations {
 public:
  explicit FitEquations(const std::vector<Face>& faces, std::size_t vertices);
  ~FitEquations();

  void clear();
  // A sample whose proxy point has these barycentric weights in `face`.
  void add(std::uint32_t face, const Eigen::Vector3d& weights, const FitTerm& term);

  // The step of every vertex. With a volume gradient (one per vertex) the step changes the linear
  // volume by exactly volume_change; without (empty) it is free. Empty when there is no solution.
  std::vector<Eigen::Vector3d> solve(const std::vector<Eigen::Vector3d>& volume_gradient,
                                     double volume_change);

 private:
  struct FaceSums {
    std::array<Eigen::Matrix3d, 6> blocks;  // 00 01 02 11 12 22
    std::array<Eigen::Vector3d, 3> right;
  };
  struct Solver;

  const std::vector<Face>& faces_;
  std::size_t vertices_;
  std::vector<FaceSums> sums_;
  std::unique_ptr<Solver> solver_;
};

}  // namespace organbake
