// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <vector>

#include "shading/grid.h"

namespace organbake {

// dv/di at index i of n values `stride` apart: central, of fourth order where there is room and of
// second order elsewhere (one-sided at the ends).
double derivative_at(const float* v, int i, int n, std::ptrdiff_t stride);

// The same for a whole row at once, per pixel: along it (by x), and across it (by y).
void derivatives_along(const Plane& v, int row, std::vector<double>& by_x);
void derivatives_across(const Plane& v, int row, std::vector<double>& by_y);

}  // namespace organbake
