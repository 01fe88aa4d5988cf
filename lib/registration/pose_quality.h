// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "registration/refine.h"
#include "registration/register_photo.h"

namespace organbake {

// Everything that is asked of a finished pose, and the verdict over it.
PoseQuality assess(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                   const RefineOptions& options, const RefineState& state, double runner_up_margin,
                   const RunContext& context);

}  // namespace organbake
