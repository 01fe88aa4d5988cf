// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// What people use today, with the settings that serve each best; input and output in our mesh.
TriangleMesh vtk_quadric_decimation(const TriangleMesh& surface, std::size_t faces);
TriangleMesh meshoptimizer_simplify(const TriangleMesh& surface, std::size_t faces);

}  // namespace organbake
