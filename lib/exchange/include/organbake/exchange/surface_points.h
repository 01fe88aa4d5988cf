// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/formats/camera_files.h"

namespace organbake {

// Points of the surface for those who start from a sparse model: places that a camera's map has
// (exact but for the depth's rounding), spread to at least spacing_mm by a grid, at most about
// `most` of them, in the maps' colours. Each is told for every camera whose map shows that place.
// All maps must have been read. The same for any number of threads.
std::vector<SparsePoint> surface_points(const Bundle& bundle, double spacing_mm,
                                        std::size_t most = 100000);

}  // namespace organbake
