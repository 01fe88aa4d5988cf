// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/warp/frame.h"
#include "organbake/warp/solids.h"
#include "organbake/warp/view.h"

namespace organbake {

// From which on a solid does nothing to skin: most of a shaft.
inline constexpr double kShadeReach_mm = 8;
// A shadow: the lamp's radius, its least penumbra, and how much light a full one takes.
inline constexpr double kLampRadius_mm = 1.5, kLeastSoft_mm = 0.25, kDarkestShadow = 0.72;
// What a solid that touches skin keeps off it, and in what gap that falls to 1/e.
inline constexpr double kOccluded = 0.45, kOccludedNear_mm = 1.5;
// How near a mirror image must be, and what water mirrors straight down.
inline constexpr double kMirrorReach_mm = 12, kWaterMirror = 0.03;
// Normals from depths: over so many pixels each way, where depth changes by less than this share.
inline constexpr int kNormalReach = 3;
inline constexpr double kSteepestNormal = 0.1;

// What solids do to skin by the light at the scope, in the blocks of a frame that keeps its depth,
// before they are drawn: they throw shadows, darken what they nearly touch, and are mirrored in its
// wet film. light_mm: of the light from the eye, camera axes. Triangles count by their edges.
void shade_skin_by_solids(const std::vector<Solid>& solids, const std::vector<SolidBlock>& blocks,
                          const View& view, const Eigen::Vector3d& light_mm, Frame& frame);

}  // namespace organbake
