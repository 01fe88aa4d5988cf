// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "organbake/formats/mesh_frame.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The numbers of a file as they are written, and what it says of them.
struct WrittenMesh {
  TriangleMesh mesh;
  MeshFrame frame;
};

// The triangles of a glTF 2.0 file (.glb, or .gltf with its buffers inside or beside it), in metres
// and on its own axes: every mesh of the scene with its nodes' transforms; strips and fans become
// triangles, points and lines are passed over, COLOR_0 is linear by glTF's definition. Skins, morph
// targets and animations are not followed. Throws NoInputError (a buffer's file that is missing),
// or BadDataError, also for extensions that pack the numbers away (Draco, meshopt).
TriangleMesh read_gltf(const std::filesystem::path& path);

// Polydata in VTK's legacy format, ASCII or binary, versions 1.0 to 5.1: points, polygons, strips,
// and COLOR_SCALARS when they are the first point data; everything else is passed over. Not through
// vtkPolyDataReader, which crashes on truncated files (VTK 9.1). Throws NoInputError or
// BadDataError; counts are checked against the file's size before memory is taken.
TriangleMesh read_legacy_vtk(const std::filesystem::path& path);
TriangleMesh parse_legacy_vtk(std::span<const std::byte> bytes, const std::string& name);

// The polygons and strips of a .vtp file, and the outside of a .vtu file's cells: of solids their
// surface, of faces themselves. Throws BadDataError.
WrittenMesh read_vtp(const std::filesystem::path& path);
WrittenMesh read_vtu(const std::filesystem::path& path);

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
