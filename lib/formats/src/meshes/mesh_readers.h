// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Meshes in double precision, as VTK's readers do not give them. Polygons are cut into triangles;
// coordinates are as written; all throw BadDataError with `name` and, for text, the line.

// Wavefront OBJ: v (with colours behind the place: sRGB, 0…1 or 0…255) and f; indices of textures
// and normals are not asked, so that their seams do not part the surface. Negative indices count
// from the end; lines that continue after a backslash are joined.
TriangleMesh parse_obj(std::string_view text, const std::string& name);

// OFF, COFF, NOFF, STOFF and their mixtures, as text. Colours of vertices are read.
TriangleMesh parse_off(std::string_view text, const std::string& name);

// STL, binary or text in any letters. Every triangle has corners of its own. A binary one may have
// bytes behind its triangles.
TriangleMesh parse_stl(std::string_view bytes, const std::string& name);

}  // namespace organbake
