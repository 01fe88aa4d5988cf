// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The edges of a mesh in which other than two faces meet cut it into patches.
struct Patches {
  std::vector<std::uint32_t> of_face;  // a patch for every face
  std::size_t count = 0;
  std::vector<bool> at_crowded_edge;  // whether three or more faces meet at an edge of the patch
};
Patches patches_of(const TriangleMesh& mesh);

// How much of each side of the patches is seen from outside the mesh: share of rays from points
// spread over the patch that reach it. Front is where faces wind counter-clockwise; the winding
// within a patch must be consistent.
struct SeenShare {
  double front = 0, back = 0;
};
std::vector<SeenShare> seen_from_outside(const TriangleMesh& mesh, const Patches& patches);

}  // namespace organbake
