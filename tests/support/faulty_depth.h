// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

// How the depth of a real endoscope errs, and what else it shows.
struct DepthFaults {
  double noise = 0.02;      // of a pixel, share of its depth: standard deviation
  double bias = 0;          // at most so much of all depth, either way
  double bumps_mm = 0;      // smooth over some 20 mm: standard deviation
  double hidden_share = 0;  // of the view, by fat that lies up to 12 mm before the organ
  double mm_per_unit = 1;   // of the lengths that come out
};

// Points that a depth map of the organ shows, in the camera's axes: of each pixel one; beside the
// organ a wall that stands `wall_mm` from the camera, aslant. Seeded.
std::vector<Eigen::Vector3d> faulty_depth(const RayScene& organ, const PosedCamera& camera,
                                          double wall_mm, const DepthFaults& faults,
                                          std::uint64_t seed);

}  // namespace organbake
