// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "organbake/fusion/depth_view.h"

namespace organbake {

// Which lengths of depth maps and poses belong together.
enum class DepthScale {
  automatic,  // one where the maps are relative, or agree far better by it; else as given
  given,      // depths and poses are in one unit
  one,        // one scale between the depths of all maps and the poses
  each        // one for each map
};

struct SolvedScale {
  double place_factor = 1;           // of the cameras' places, in the unit of the depths
  std::vector<double> depth_factor;  // of each map's depths; their geometric mean is 1
  // How far apart in depth the views have the same place, median, as a share of the depth: by this
  // scale, with the depths and poses as they were, and if the cameras did not move at all.
  double apart = 1, apart_as_given = 1, apart_unmoved = 1;
  // Whether the scope's motion tells: without it the views would lie clearly farther apart.
  bool told() const;
};

// The scale by which the views agree best about the surface: what a place's depth is in the view
// that shows it against what another view, moved by the scaled poses, has there (robust: by
// Cauchy's weight, as many places as can be). Scales are tried over the range in which the path of
// the cameras lies between a fiftieth and eight times the depths, then the best is refined.
// Deterministic. Views that show nothing in common at any of them have apart = 1. The views are
// moved on the way, and come back as they were.
SolvedScale solve_scale(std::vector<SmoothView>& views, bool each);

}  // namespace organbake
