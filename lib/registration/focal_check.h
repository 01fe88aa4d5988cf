// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "registration/refine.h"

namespace organbake {

// What the photograph says of the focal length when it may differ from the given one: found
// together with the pose. Distance stands in for most of it, and an unmodelled light for some, so
// its own standard deviation comes with it.
struct FocalCheck {
  double log_scale = 0;  // ln of what the given one should be multiplied by
  double log_sd = 0;     // infinite when it cannot be told
};

FocalCheck check_focal(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                       RefineOptions options, const RefineState& state, const RunContext& context);

}  // namespace organbake
