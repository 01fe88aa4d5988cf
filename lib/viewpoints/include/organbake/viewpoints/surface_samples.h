// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/viewpoints/sight.h"

namespace organbake {

// The surface, a colour a vertex by how many of the cameras show it well: red = none, yellow = one,
// green = two, blue = three or more; grey = none of the region's views does.
TriangleMesh painted_by_cameras(const TriangleMesh& surface, const Sight& sight,
                                const std::vector<Eye>& cameras, const std::vector<Eye>& region,
                                const SightLimits& well);

// A push on the surface: everything moves along `displacement_mm`, by exp(−r²/2σ²) of it at the
// distance r from the site. Smooth and without folds for σ > 0.61 |displacement|.
struct Poke {
  Eigen::Vector3d site_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d displacement_mm = Eigen::Vector3d::Zero();
  double sigma_mm = 1;
};

TriangleMesh poked_surface(TriangleMesh surface, const Poke& poke);

}  // namespace organbake
