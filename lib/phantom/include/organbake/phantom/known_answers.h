// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Small inputs whose answer is known: a ball's CT, and the surfaces on which shape from shading is
// usually measured.

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/shading/grid.h"
#include "organbake/shading/shape_from_shading.h"
#include "organbake/volume/volume.h"

namespace organbake {

inline constexpr double kBallAir_hu = -1000, kBallTissue_hu = 60;
inline constexpr double kBallHalfWay_hu = (kBallAir_hu + kBallTissue_hu) / 2;

// A ball round the world's origin as a scanner without noise sees it: every voxel is the mean over
// its box. The grid's middle is off the origin by a part of a voxel and 10 mm of air lie around.
Volume scan_ball(double radius_mm, const Eigen::Vector3d& spacing_mm);

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

// Adds Gaussian noise of this share of full scale, and leaves 8 bits.
void add_noise(Plane& intensity, double share, std::uint64_t seed);

}  // namespace organbake
