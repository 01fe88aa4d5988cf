// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/core/run_context.h"
#include "organbake/motion/bundle_adjustment.h"
#include "organbake/motion/triangulation.h"

namespace organbake {

struct ReconstructionOptions {
  FreeLens lens;  // what of it is to be found; none = it is given
  TriangulationOptions triangulation;
  // A pair that a plane, a pure turn or a zoom explains to less than this tells no shape.
  double least_parallax_px = 2;
  double least_pair_angle_rad = 0.02;  // between the rays of the first pair, median
  // A view whose sightings agree by less than this share sees something else that moves.
  double least_agreeing_share = 0.2;
};

struct ReconstructionSummary {
  double parallax_px = 0;  // the most that a pair of views has
  std::string failure;     // why there is none; empty when there is one
};

// Poses, places and lens of a clip's views, one after another (Schönberger & Frahm 2016): a first
// pair by its essential matrix, then of two dozen key views each next one from the places that it
// sees, new places from the views that are posed, and bundle adjustment as the scene grows; last,
// all views between, which the places hold. Views that no rigid scene explains stay without a pose.
// The scene comes with its landmarks' sightings and a lens to start from. Deterministic.
ReconstructionSummary reconstruct(const ReconstructionOptions& options, Scene& scene,
                                  const RunContext& context = {});

}  // namespace organbake
