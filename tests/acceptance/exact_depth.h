// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <memory>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Where a ray first meets a mesh, by CGAL's AABB tree: predicates exact, the point in double.
class ExactDepth {
 public:
  explicit ExactDepth(const TriangleMesh& mesh);
  ~ExactDepth();

  // In units of |direction|; +inf when the ray meets nothing.
  double first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace organbake
