// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "geometry/triangle_mesh.h"

namespace organbake {

// Closed outward meshes with known answers (mm).
TriangleMesh tetrahedron_mesh();                               // corners 0, x, y, z: volume 1/6
TriangleMesh box_mesh(const Eigen::Vector3d& size_mm);         // from 0 to size
TriangleMesh sphere_mesh(double radius_mm, int subdivisions);  // 20·4ⁿ faces, vertices on it
// A star-shaped body that no mirroring maps onto itself.
TriangleMesh lumpy_mesh(double radius_mm, int subdivisions);

}  // namespace organbake
