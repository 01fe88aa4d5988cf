// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "organbake/image/channel_image.h"
#include "organbake/player/carried_surface.h"

namespace organbake {

// Colour steps in 8-bit sRGB, the largest of the three channels.
struct SeamSteps {
  double frame = 0;   // the largest step in the frame
  double truth = 0;   // the largest step in the truth
  double excess = 0;  // the largest |step in the frame| − |step in the truth| of one place
  std::size_t places = 0;
};

// Steps across the proxy's edges: along the picture of each edge, pixel pairs of which one shows
// one face and the other the other are averaged, signed, so that texture cancels and a seam stays.
// The truth is its sharp picture: averaging a pixel's rays would soften the steps that its own
// texture and folds make, and a frame is not averaged. Edges with fewer than 40 pairs are too short
// to tell. All pictures have one size.
SeamSteps edge_steps(const Rgb8Image& frame, const TruthFrame& truth);

// Steps in time, when the set of active cameras changes between two views that hardly differ: means
// of 8×8 pixel blocks that both pictures cover, before against after.
SeamSteps switch_steps(const Rgb8Image& before, const Rgb8Image& after,
                       const TruthFrame& truth_before, const TruthFrame& truth_after);

}  // namespace organbake
