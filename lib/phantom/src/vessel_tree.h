// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace organbake {

// A disc of a vessel's course over a surface, seen from above.
struct VesselSpot {
  Eigen::Vector2d center_mm;
  double radius_mm;
};

// Vessels that wander, taper and branch within ±reach, as the discs that they cover, near enough to
// each other to leave no gap. `count` trees, whose stems are 0.3 to 2 mm wide.
std::vector<VesselSpot> grow_vessels(std::uint64_t seed, int count,
                                     const Eigen::Vector2d& reach_mm);

}  // namespace organbake
