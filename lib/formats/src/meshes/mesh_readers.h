// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "organbake/core/run_context.h"
#include "organbake/formats/mesh_frame.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Meshes in double precision, as VTK's readers do not give them. Polygons are cut into triangles;
// coordinates are as written; all throw BadDataError with the file's name and, for text, the line.

// Wavefront OBJ: v (with colours behind the place: sRGB, 0…1 or 0…255) and f; indices of textures
// and normals are not asked, so that their seams do not part the surface. Negative indices count
// from the end; lines that continue after a backslash are joined.
TriangleMesh parse_obj(std::string_view text, const std::string& name);

// OFF, COFF, NOFF, STOFF and their mixtures, as text. Colours of vertices are read.
TriangleMesh parse_off(std::string_view text, const std::string& name);

// STL, binary or text in any letters. Every triangle has corners of its own. A binary one may have
// bytes behind its triangles.
TriangleMesh parse_stl(std::string_view bytes, const std::string& name);

// VTK's legacy format, ASCII or binary, versions 1.0 to 5.1 (legacy_vtk.cpp): polydata, and the
// outside of unstructured grids.
TriangleMesh read_legacy_vtk(const std::filesystem::path& path);

// The numbers of a file as they are written, and what it says of them.
struct WrittenMesh {
  TriangleMesh mesh;
  MeshFrame frame;
};

// The polygons and strips of a .vtp file, and the outside of a .vtu file's cells: of solids their
// surface, of faces themselves.
WrittenMesh read_vtp(const std::filesystem::path& path);
WrittenMesh read_vtu(const std::filesystem::path& path);

// The triangles of a glTF 2.0 file (.glb, or .gltf with its buffers inside or beside it), in metres
// and on its own axes: every mesh of the scene where its nodes, their instances
// (EXT_mesh_gpu_instancing), its skin's joints and its morph weights put it; strips and fans become
// triangles, points and lines are passed over, COLOR_0 is linear by glTF's definition. What would
// change the shape and is not followed is warned of: animations, and extensions that are not known.
// Throws NoInputError (a buffer's file that is missing), or BadDataError, also for an extension
// that the file requires and that is not known, or packs the numbers away (Draco, meshopt).
TriangleMesh read_gltf(const std::filesystem::path& path, const RunContext& context = {});

}  // namespace organbake
