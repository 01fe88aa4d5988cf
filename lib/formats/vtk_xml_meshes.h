// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "geometry/triangle_mesh.h"

namespace organbake {

// The polygons and strips of a .vtp file, and the outside of a .vtu file's cells: of solids their
// surface, of faces themselves. Throws BadDataError.
TriangleMesh read_vtp(const std::filesystem::path& path);
TriangleMesh read_vtu(const std::filesystem::path& path);

}  // namespace organbake
