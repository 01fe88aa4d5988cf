// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "organbake/geometry/camera.h"

namespace organbake {

struct NeighbourOptions {
  int most = 8;
  // Between the rays to one point: less tells little of depth, more makes pictures unlike.
  double best_angle_rad = 0.08, least_angle_rad = 0.012, most_angle_rad = 0.6;
  // Frames that lie farther off in the list count less: tissue moves meanwhile. 0 = time says
  // nothing.
  double usual_gap = 0;
  double least_overlap = 0.5;  // share of the reference's picture that the other frame shows
};

// The frames whose rays meet the reference's at the best angles at this depth, from as many sides
// as there are; the best first, fewer than asked for where others are too near, too far or look
// elsewhere.
std::vector<std::size_t> best_neighbours(const std::vector<PosedCamera>& cameras,
                                         std::size_t reference, double depth,
                                         const NeighbourOptions& options = {});

}  // namespace organbake
