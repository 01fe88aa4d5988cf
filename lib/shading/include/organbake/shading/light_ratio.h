// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/shading/laparoscope.h"

namespace organbake {

// Brightness of a surface under the light as the options place it, over that under a light at the
// optical centre with an even beam. log_range_mm: ln r, r in mm; one value per ray.
// Where the surface turns away from the light the ratio is held at a twentieth.
Plane light_ratio(const Plane& log_range_mm, const RayGrid& rays,
                  const LaparoscopeOptions& options);

}  // namespace organbake
