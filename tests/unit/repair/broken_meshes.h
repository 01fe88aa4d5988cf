// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// A mesh as segmentation programs, editors and converters leave it, and what it was made from.
struct BrokenMesh {
  std::string name;
  TriangleMesh mesh;
  TriangleMesh meant;       // sound: of the right shape and volume
  bool needs_wrap = false;  // nothing short of a wrap makes it an organ
  bool open = false;        // a surface with a border, and to stay one
};

// Twenty-four of them, anatomy-like: lumpy organs, lobes, vessels and voxels with non-manifold
// edges and vertices, tunnels, islands, duplicates, doubled vertices, mixed winding, holes, fins,
// walls.
std::vector<BrokenMesh> broken_meshes();

}  // namespace organbake
