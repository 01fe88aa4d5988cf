// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "geometry/triangle_mesh.h"

namespace organbake {

// Parts what touches along edges of four or more faces, or at a vertex of several fans: round each
// such edge the two faces that bound the same solid stay together, and every fan of faces gets a
// vertex of its own; vertices without a face go. Faces must look outward. Colours go along. Returns
// how many vertices were added.
std::size_t split_edges(TriangleMesh& mesh);

}  // namespace organbake
