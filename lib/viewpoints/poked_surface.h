// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "geometry/triangle_mesh.h"

namespace organbake {

// A push on the surface: everything moves along `displacement_mm`, by exp(−r²/2σ²) of it at the
// distance r from the site. Smooth and without folds for σ > 0.61 |displacement|.
struct Poke {
  Eigen::Vector3d site_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d displacement_mm = Eigen::Vector3d::Zero();
  double sigma_mm = 1;
};

TriangleMesh poked_surface(TriangleMesh surface, const Poke& poke);

}  // namespace organbake
