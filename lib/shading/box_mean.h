// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "shading/grid.h"

namespace organbake {

// Mean over the inside pixels of a square window of 2·radius + 1; where there are none, 0.
Plane box_mean(const Plane& plane, const Mask& inside, int radius);

}  // namespace organbake
