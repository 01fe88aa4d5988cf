// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "disparity.h"
#include "organbake/shading/prepared_frame.h"

namespace organbake {

// Leaves as instruments what both frames' masks name and what does not lie on the surface around
// it: tissue that looks like a shaft has the depth of its surroundings, a shaft does not.
void keep_instruments_off_the_surface(const DisparityRange& range, PreparedFrame& left,
                                      PreparedFrame& right);

}  // namespace organbake
