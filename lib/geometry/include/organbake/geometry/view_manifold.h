// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace organbake {

// The viewing projection manifold (VPM, the paper's Figure 2) in the form a viewer needs: the dual
// of the polyhedron that the cameras' view planes bound, i.e. triangles of cameras over the sphere
// of directions round the organ's centre.
struct ViewManifold {
  Eigen::Vector3d center_world_mm = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> directions;              // unit, centre → camera, one per camera
  std::vector<std::array<std::uint32_t, 3>> triangles;  // camera indices; empty with < 3 cameras
};

struct ViewWeights {
  std::array<std::uint32_t, 3> cameras{};
  std::array<double, 3> weights{};  // ≥ 0, sum 1; unused entries have weight 0
};

// The three cameras for a view from `eye_direction` (centre → eye, any length) and weights that
// are continuous in it: the direction's barycentric coordinates in the triangle it pierces,
// normalised to sum 1. Beyond the cameras' hull the direction is clamped to the nearest triangle
// edge. With one or two cameras, or none pierced, the nearest cameras share by angle.
ViewWeights view_weights(const ViewManifold& manifold, const Eigen::Vector3d& eye_direction);

}  // namespace organbake
