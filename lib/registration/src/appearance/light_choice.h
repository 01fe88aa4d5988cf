// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "pose/pose_refinement.h"

namespace organbake {

// One light that a photograph was explained by.
struct LightTrial {
  LightModel model = LightModel::camera;
  RefineState state;  // refined under it
  // RMS of the organ's pixels about what a light predicts of them that was fitted to other pixels:
  // squares of the picture take turns, as a chessboard's. A light that only has more freedom
  // predicts no better what it wasn't fitted to, so nothing else punishes its freedom. Share of the
  // luminance range; infinite when the organ is out of the picture.
  double held_out_rms = 0;
};

// Refines each of `states` (under the model of the same number) from level `first` to `last`, and
// tells how well each predicts there.
std::vector<LightTrial> try_lights(const RegisteredSurface& surface,
                                   const std::vector<PhotoLevel>& pyramid, int first, int last,
                                   const RefineOptions& options,
                                   const std::vector<LightTrial>& starts,
                                   const RunContext& context);

// The first, in the order given, that predicts about as well as the best: the simplest comes first.
const LightTrial& simplest_of_best(const std::vector<LightTrial>& trials);

}  // namespace organbake
