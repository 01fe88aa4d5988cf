// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/formats/mesh_frame.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The numbers of a file as they are written, and what it says of them.
struct WrittenMesh {
  TriangleMesh mesh;
  MeshFrame frame;
};

// The polygons and strips of a .vtp file, and the outside of a .vtu file's cells: of solids their
// surface, of faces themselves. Throws BadDataError.
WrittenMesh read_vtp(const std::filesystem::path& path);
WrittenMesh read_vtu(const std::filesystem::path& path);

}  // namespace organbake
