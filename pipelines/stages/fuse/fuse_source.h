// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/fusion/depth_view.h"
#include "organbake/pipelines/stage.h"

namespace organbake {

struct DepthViews {
  std::vector<DepthView> views;
  std::vector<std::string> without_pose;  // file names of maps that were left out
  std::string by_number;                  // MatchedPoses::by_number
};

// The depth maps of a call with their cameras, confidences and pictures. `mm_per_unit` is of depths
// that are not relative. Throws NoInputError, BadDataError.
DepthViews read_depth_views(const StageCall& call, double mm_per_unit);

}  // namespace organbake
