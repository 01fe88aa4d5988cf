// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Carries colours over a mesh from the vertices that have one (known ≠ 0) to all others: each takes
// the mean of the neighbours nearer to a known one, then the carried colours are smoothed. Pieces
// without any known vertex take the mean of all known ones. Throws BadDataError when none is known.
void flood_colors(const TriangleMesh& mesh, const std::vector<char>& known,
                  std::vector<Eigen::Vector3f>& colors);

}  // namespace organbake
