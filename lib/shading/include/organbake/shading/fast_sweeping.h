// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/shading/grid.h"
#include "organbake/shading/ray_grid.h"

namespace organbake {

// Solves  ln I = −2v − ½ ln(1+G),  G = (1+x²+y²)(v_x² + v_y² + (x v_x + y v_y)²)  for v = ln r
// along the pixels' rays: a camera with its light at the optical centre and 1/r² falloff (Prados &
// Faugeras 2005). Godunov's upwind differences, Gauss–Seidel in the four orders of fast sweeping
// (Zhao 2005); at the border and at masked pixels only what lies inside is used. The viscosity
// solution is unique, so the start does not matter; one close to it saves sweeps.
//   log_image: ln I, one value per ray; inside: pixels to solve for; v: start, becomes the result.
// Ends when four sweeps change v by less than the tolerance; returns how many there were.
int sweep_log_range(const Plane& log_image, const Mask& inside, const RayGrid& rays, Plane& v,
                    int most_sweeps, double tolerance);
// The same with ranges kept in double precision: what single precision costs is measured by it.
int sweep_log_range(const Plane& log_image, const Mask& inside, const RayGrid& rays,
                    Grid<double>& v, int most_sweeps, double tolerance);

// −½ ln I: the farthest that each pixel can be; a start that is right where the surface is frontal.
Plane farthest_log_range(const Plane& log_image);

}  // namespace organbake
