// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "depth/depth_alignment.h"
#include "organbake/core/run_context.h"

namespace organbake {

struct FoundByDepth {
  DepthState state;
  ScalePrior prior;
  double cost = 2;
  // By what share less the pose costs than the best one elsewhere; 1 without one.
  double runner_up_margin = 1;
};

// The pose of the surface in a photograph whose depth is known, near a start that is up to about 35
// mm and 20° off: alignments from places all round the start by few of the points, of which the
// best are followed with more. Threads across starts; ordered and seeded, so repeatable.
FoundByDepth search_by_depth(const RegisteredSurface& surface, const SeenDepth& depth,
                             const ObjectPose& start, const RunContext& context);

}  // namespace organbake
