// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>

#include "core/run_context.h"
#include "geometry/triangle_mesh.h"

namespace organbake {

enum class MeshUnit { mm, cm, m, inch };
double mm_per(MeshUnit unit);

// Reads a surface mesh by its name's ending: .ply, .obj, .stl, .off, .vtk (legacy polydata), .vtp,
// .vtu (the outside of its cells), .glb, .gltf. Polygons become triangles; colours become linear
// ones; vertices of open edges that coincide are welded, and their number is told. Coordinates are
// taken in `unit`, unless the file says its own: glTF is in metres by definition (axes are kept as
// written), our own PLY in mm. Sizes that no organ has are warned of, with the unit that would make
// sense. Throws NoInputError, UsageError (unknown ending) or BadDataError (damaged, no faces, bad
// index, NaN).
TriangleMesh read_mesh(const std::filesystem::path& path, MeshUnit unit = MeshUnit::mm,
                       const RunContext& context = {});
// The unit that the file's coordinates are in, judged by the size of a mesh that was read from it
// in `unit`: that unit where the size is an organ's, else the one that would make it one, or
// "none".
std::string suspected_unit(const TriangleMesh& mesh, const std::filesystem::path& path,
                           MeshUnit unit = MeshUnit::mm);

}  // namespace organbake
