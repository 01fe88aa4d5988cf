// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace organbake {

// Barycentric weights of the point of triangle abc nearest to p (Ericson, Real-Time Collision
// Detection, 5.1.5). A triangle that is an edge or a point gives the nearest of what it is.
Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c);

}  // namespace organbake
