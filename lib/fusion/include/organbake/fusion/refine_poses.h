// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "organbake/fusion/depth_view.h"

namespace organbake {

struct PoseRefinement {
  int rounds = 30;           // at most
  double place_mm = 1;       // how far off cameras are given, standard deviation
  double angle_rad = 0.018;  // and how much turned
};

struct RefinedPoses {
  int rounds = 0;
  double moved_mm = 0, turned_rad = 0;  // the camera that was farthest off
  double before_mm = 0, after_mm = 0;   // from view to view, along the normal, root mean square
};

// Moves the cameras so that each view's points lie on the surfaces that the others see (point to
// plane, all views at once, Gauss–Newton with a robust weight), within small motions: each is held
// where it was given, as firmly as that is likely to be right. Deterministic.
RefinedPoses refine_poses(const PoseRefinement& options, std::vector<SmoothView>& views);

// How far the views' surfaces are apart as they are, along the normal, root mean square.
double views_apart_mm(std::vector<SmoothView> views);

}  // namespace organbake
