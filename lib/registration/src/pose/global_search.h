// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "pose/pose_refinement.h"

namespace organbake {

struct SearchResult {
  RefineState best;
  int level = 0;                // of the pyramid that the best was refined to
  double runner_up_margin = 1;  // of PoseQuality
};

// Finds the pose without any start: small renderings from directions all round, in all rolls,
// correlated with the coarsest level; the best distinct ones are refined level by level and thinned
// out. Where the organ stands out from a plain background, its area and centre say distance and
// place; else a grid of both is tried as well. Threads across candidates; ordered, so repeatable.
SearchResult search_all_round(const RegisteredSurface& surface,
                              const std::vector<PhotoLevel>& pyramid, const RefineOptions& options,
                              const RunContext& context);

// Refines a given start on the coarsest level, and looks nowhere else.
SearchResult search_here(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                         const RigidTransform& start, const RefineOptions& options,
                         const RunContext& context);

// Refines a given start on the coarsest level; when that does not explain the photograph, together
// with the best of starts turned about it: a wider capture range.
SearchResult search_near(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                         const RigidTransform& start, const RefineOptions& options,
                         const RunContext& context);

}  // namespace organbake
