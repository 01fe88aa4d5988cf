// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "core/run_context.h"
#include "fusion/depth_view.h"
#include "pipelines/stage.h"

namespace organbake {

// The depth maps of a call with their cameras, confidences and pictures. `mm_per_unit` is of the
// depths. Throws NoInputError, BadDataError.
std::vector<DepthView> read_depth_views(const StageCall& call, double mm_per_unit);

}  // namespace organbake
