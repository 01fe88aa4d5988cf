// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// A mesh's bounds centred and scaled by a power of two to about 1, so that neither the place nor
// the unit of the data matters to thresholds.
struct UnitFrame {
  Eigen::Vector3d center;
  double scale = 1;

  explicit UnitFrame(const TriangleMesh& mesh) {
    const Bounds box = bounds(mesh);
    center = box.center();
    const double size = box.diagonal();
    if (size > 1e-150 && std::isfinite(size)) scale = std::scalbn(1.0, -std::ilogb(size));
  }
  Eigen::Vector3d into(const Eigen::Vector3d& point) const { return scale * (point - center); }
  Eigen::Vector3d back(const Eigen::Vector3d& point) const { return point / scale + center; }
  TriangleMesh into(TriangleMesh mesh) const {
    for (Eigen::Vector3d& v : mesh.vertices) v = into(v);
    return mesh;
  }
  TriangleMesh back(TriangleMesh mesh) const {
    for (Eigen::Vector3d& v : mesh.vertices) v = back(v);
    return mesh;
  }
};

}  // namespace organbake
