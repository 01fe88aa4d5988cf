// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/warp/view.h"

namespace organbake {

// A scope of 70° across, of pictures of 16 : 9.
inline constexpr double kScopeFocal_widths = 914.0 / 1280;

// The skin that a scope is held toward: the proxy's point that lies farthest toward a direction,
// and the mean normal of 15 mm about it.
struct ScopeAim {
  Eigen::Vector3d point_mm, normal;
};
ScopeAim scope_aim(const TriangleMesh& proxy, const Eigen::Vector3d& toward);

// From range_mm over that point, leaning by some 25°.
View scope_view(const ScopeAim& aim, double range_mm, int width_px);

}  // namespace organbake
