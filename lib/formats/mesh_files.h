// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "geometry/triangle_mesh.h"

namespace organbake {

// Reads a surface mesh by its name's ending: .ply, .obj, .stl, .vtk (legacy polydata), .vtp.
// Polygons become triangles; coordinates are taken as world millimetres; 8-bit point colours become
// linear ones. The shared corners of an STL, which stores every triangle apart, are merged. Throws
// NoInputError, UsageError (unknown ending) or BadDataError (damaged, no faces, bad index, NaN).
TriangleMesh read_mesh(const std::filesystem::path& path);

}  // namespace organbake
