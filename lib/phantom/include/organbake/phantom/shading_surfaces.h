// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/shading/distant.h"
#include "organbake/shading/grid.h"

namespace organbake {

// The surfaces on which shape from shading is usually measured, with what an ideal camera sees.

// "vase", "sphere", "gauss", "sombrero", "peaks" (Zhang et al. 1999 and others), size × size
// pixels, orthographic, lit from afar with albedo 1.
struct DistantScene {
  Plane intensity;  // max(0, n·s)
  Plane depth;      // Z, pixels, away from the camera
};
const std::vector<std::string>& distant_scene_names();
DistantScene distant_scene(const std::string& name, int size, const DistantLight& light);

// ln r = ln 60 + 0.06 A [peaks at 5.2 x, 5.2 y] for a laparoscope of focal length `size`, light at
// the optical centre, brightest pixel 1. For A = 1 ranges are 40–98 mm.
struct NearScene {
  Plane intensity;
  Plane log_range;  // ln mm
  Intrinsics camera;
};
NearScene near_scene(double amplitude, int size);

// Adds Gaussian noise of this share of full scale, and 8 bits when `eight_bit`.
void add_noise(Plane& intensity, double share, bool eight_bit, std::uint64_t seed);

}  // namespace organbake
