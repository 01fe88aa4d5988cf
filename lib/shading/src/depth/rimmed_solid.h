// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>

#include "organbake/shading/log_range_fit.h"

namespace organbake {

struct RimmedSolid {
  Plane depth;          // Z, pixels, away from the camera; 0 on the ground
  double misfit = 0;    // root mean square of I − R on the solid, off its rim
  int refinements = 0;  // conjugate-gradient steps
};

// A round thing in front of a plain ground that faces the camera, lit from afar: along its rim it
// looks away from the camera (the occluding contour of Ikeuchi & Horn 1981), where slopes are
// infinite and no difference of depths can follow them. Its height is therefore sought as
//   h = √(u e^ε),   −Δu = 1 on the solid, u = 0 on the ground,
// which has such a rim for every smooth ε (a sphere and a cylinder have constant ones): first one ε
// for all by least misfit, then ε(x, y) by Gauss–Newton with a bending penalty. Nothing when no
// such ground surrounds anything. The image's intensities are divided by the albedo; `noise` is
// their standard deviation.
std::optional<RimmedSolid> shade_rimmed_solid(const ShadedImage& image,
                                              const Eigen::Vector3d& toward, double noise);

}  // namespace organbake
