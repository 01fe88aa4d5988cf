// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "organbake/shading/grid.h"
#include "sweep_costs.h"

namespace organbake {

struct SmoothnessOptions {
  int step = 24;    // what a step to the next label costs, where a match costs 0…250
  int jump = 240;   // what a farther one costs, within one piece of tissue
  float edge = 12;  // grey levels from one pixel to the next at which a jump costs half
};

// Sums of the costs with what neighbours ask for, along eight directions (semi-global matching,
// Hirschmüller 2008). Labels of a pixel side by side, as in the volume.
std::vector<std::uint16_t> aggregated(const CostVolume& volume, const Plane& grey,
                                      const SmoothnessOptions& options);

}  // namespace organbake
