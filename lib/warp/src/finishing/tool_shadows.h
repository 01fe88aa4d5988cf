// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/warp/frame.h"
#include "organbake/warp/solids.h"
#include "organbake/warp/view.h"

namespace organbake {

// The same solids, wider by how far from skin they still shade it: for solid_blocks().
std::vector<Solid> with_shadows(std::vector<Solid> solids);

// What solids do to skin by the light at the scope, in the blocks of a frame that keeps its depth,
// before they are drawn: they throw shadows, darken what they nearly touch, and are mirrored in its
// wet film. light_mm: of the light from the eye, camera axes. Triangles count by their edges.
void shade_skin_by_solids(const std::vector<Solid>& solids, const std::vector<SolidBlock>& blocks,
                          const View& view, const Eigen::Vector3d& light_mm, Frame& frame);

}  // namespace organbake
