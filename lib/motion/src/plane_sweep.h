// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/shading/grid.h"
#include "posed_frame.h"

namespace organbake {

struct DepthRange {
  double nearest = 0, farthest = 0;  // planar z, in the unit of the poses

  void check() const;  // throws UsageError: 0 < nearest < farthest
};

struct SweepOptions {
  double label_px = 0.5;     // parallax from one depth that is tried to the next
  int most_labels = 160;     // of the coarsest level, which tries the whole range
  int refining_labels = 17;  // of each finer level, round what the coarser one found
  int coarsest_px = 340;     // the longest side that the whole range is tried at, at most
  int window_radius_px = 5;  // of the correlation
  int best = 4;              // of the neighbours that are believed at each pixel
  int smooth_step = 24;      // what a step to the next label costs, where a match costs 0…250
  int smooth_jump = 240;     // what a farther one costs within one piece of tissue
  double least_correlation = 0.3;  // of what is taken for a match at all

  void check() const;  // throws UsageError
};

// What parallax tells of one frame.
struct SweptDepth {
  Plane depth;        // planar z; +inf where nothing is known
  Plane relative_sd;  // of the depth, from the width of the correlation's maximum
  Plane confidence;   // 0…1: how surely the match is the right one
};

// Depth of `reference` by plane sweep (Collins 1996) over inverse depth: correlations with the
// neighbours, the best of each pixel (hidden places drop out), made smooth along the picture by
// semi-global matching, from coarse to fine; on finer levels the sweep follows the coarser one's
// surface, so that windows lie on it. Frames may be of different sizes and lenses. Throws
// BadDataError when there is no neighbour, or a plane is not of its camera's size.
SweptDepth sweep_depth(const PosedFrame& reference,
                       const std::vector<const PosedFrame*>& neighbours, const DepthRange& range,
                       const SweepOptions& options, const RunContext& context = {});

}  // namespace organbake
