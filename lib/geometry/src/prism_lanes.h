// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "organbake/geometry/prism.h"
#include "organbake/geometry/shell.h"

namespace organbake {

// Some points, a lane each: neighbours in a map lie over the same few faces.
inline constexpr std::size_t kPrismLanes = 4;
using Vec4d [[gnu::vector_size(32)]] = double;
using LaneMask [[gnu::vector_size(32)]] = std::int64_t;  // −1: yes
struct LanePoints {
  Vec4d x, y, z;
};

inline bool any(const LaneMask& mask) { return ((mask[0] | mask[1]) | (mask[2] | mask[3])) != 0; }

// Side walls are shared by two prisms; this much outside still counts as in, so that rounding
// leaves no gap between neighbours.
inline constexpr double kWallTolerance = 1e-9;
// How far from a point, of the face's size, what its binding makes of it may lie: where a proxy is
// folded flat the cubic vanishes and its roots mean nothing.
inline constexpr double kRebindRounding = 1e-6;

// The bindings that four points have found so far.
struct LaneBindings {
  Vec4d least_height;  // |h|, or as much as it must be less than
  Vec4d b1, b2, height;
  LaneMask face;
};

inline LaneMask holds(const PrismBounds& prism, const LanePoints& points) {
  const auto beyond_plane = [&](std::size_t d) {
    const Eigen::Vector3d& n = prism.direction[d];
    return n.x() * points.x + n.y() * points.y + n.z() * points.z - prism.extent[d];
  };
  Vec4d beyond = beyond_plane(0);
  for (std::size_t d = 1; d < prism.direction.size(); ++d) {
    const Vec4d by = beyond_plane(d);
    beyond = by > beyond ? by : beyond;
  }
  return beyond <= prism.slack;
}

// Binds the lanes of `asked` whose points the face's prism holds at a height less than the least
// yet. Returns the lanes that it cannot answer, where the cubic may have several such heights.
LaneMask bind_lanes(const ShellMatrix& m, const PrismCubic& cubic, std::uint32_t face,
                    const LanePoints& points, const LaneMask& asked, LaneBindings& best);

}  // namespace organbake
