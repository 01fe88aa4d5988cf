// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace organbake {

// A place on a surface and the surface's direction there, a unit vector.
struct DirectedPlace {
  Eigen::Vector3d at_mm, normal;
};

// Where places lie for a plate: along the directions in which those that it runs through spread
// and, beyond what follows from those, their normals. r³ is only fit for interpolation together
// with all affine functions of the space that r is measured in, and those need places that spread
// in all of it.
class PlateSpace {
 public:
  PlateSpace() = default;
  // twist_mm: what a turn of 1 rad counts as.
  PlateSpace(const std::vector<DirectedPlace>& through, const DirectedPlace& center,
             double twist_mm);

  Eigen::Index dimensions() const { return place_axes_.rows() + normal_axes_.rows(); }
  Eigen::VectorXd operator()(const DirectedPlace& place) const;

 private:
  DirectedPlace center_;
  Eigen::MatrixXd place_axes_, normal_axes_, place_in_normal_;
};

// A thin plate (Duchon 1977) through some places of a surface, the first of which it is about.
class ThinPlate {
 public:
  ThinPlate() = default;
  // reach_mm: how far it counts.
  ThinPlate(const std::vector<DirectedPlace>& through, double twist_mm, double reach_mm);

  // Fades from 1 to 0 at the plate's reach, twice continuously differentiable (Wendland 1995).
  double share(const DirectedPlace& place) const;
  // Of what it runs through, in that order; they sum to 1.
  Eigen::VectorXd weights(const DirectedPlace& place) const;

 private:
  Eigen::VectorXd functions(const Eigen::VectorXd& place) const;
  void solve();

  DirectedPlace center_;
  double twist_mm_ = 0, reach_mm_ = 0, size_mm_ = 0;
  PlateSpace space_;
  std::vector<Eigen::VectorXd> through_;  // in the plate's space, in sizes
  Eigen::MatrixXd inverse_;
};

}  // namespace organbake
