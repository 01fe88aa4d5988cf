// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// How near to the level a value may be, as a share of the data's range, so that the crossing is
// told from its grid point in VTK's single-precision points. Callers keep their values that far
// away from the level.
double least_distance_to_level(const std::array<int, 3>& size);

// The surface where a grid of values crosses `level`, in index coordinates: marching cubes', by
// vtkFlyingEdges3D on the values where they lie, without a copy. Every crossing is kept 1/256 of an
// edge away from the grid points, which rids the surface of the slivers that marching cubes leaves
// there. Faces look from values ≥ level to values below.
TriangleMesh contour(std::span<const std::int16_t> values, const std::array<int, 3>& size,
                     double level);
TriangleMesh contour(std::span<const float> values, const std::array<int, 3>& size, double level);

}  // namespace organbake
