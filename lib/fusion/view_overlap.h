// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "fusion/depth_view.h"

namespace organbake {

// How a view agrees with all the others about the surface.
struct ViewOverlap {
  double share = 0;     // of its points, those that another view sees, too
  double scale = 1;     // median of its depths over theirs, along their rays
  double agreeing = 1;  // share of its points that lie where the others have a surface
};
std::vector<ViewOverlap> measure_overlap(const std::vector<SmoothView>& views);

// Throws BadDataError for a view that sees nothing that another one sees, or is of another scale.
void check_overlap(const std::vector<ViewOverlap>& overlaps, const std::vector<DepthView>& views);

}  // namespace organbake
