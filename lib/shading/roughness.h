// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "shading/log_range_fit.h"

namespace organbake {

// How rough ln r may be where the image is silent (RangeFitOptions::roughness), from the surface
// itself: in proportion to its root mean square curvature on a coarse level, where noise hardly
// reaches it. Within bounds, so that neither a plane nor a level that went astray decides.
double roughness_of(const Plane& log_range, const ShadedImage& image);

}  // namespace organbake
