// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "organbake/fusion/depth_view.h"
#include "organbake/fusion/solve_scale.h"

namespace organbake {

// How depths and poses were brought to one unit.
struct FusedScale {
  DepthScale how = DepthScale::one;  // one or each
  SolvedScale solved = {};
  bool relative = false;  // the depths had no unit
  // Relative depths were brought to the poses' unit; else these were brought to the depths', whose
  // median, where they are relative, is put at kAssumedDepth_mm.
  bool in_poses_unit = false;
};
inline constexpr double kAssumedDepth_mm = 60;  // where laparoscopes work

struct ScaledViews {
  std::vector<SmoothView> views;
  std::optional<FusedScale> scale;  // nothing: depths and poses are in one unit as they are
};

// The views smoothed (smooth_view), depths and places in one unit. Throws BadDataError where some
// maps are relative and others are not.
ScaledViews scaled_views(const std::vector<DepthView>& views, DepthScale scale);

}  // namespace organbake
