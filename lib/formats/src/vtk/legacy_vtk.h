// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Polydata in VTK's legacy format, ASCII or binary, versions 1.0 to 5.1: points, polygons, strips,
// and COLOR_SCALARS when they are the first point data; everything else is passed over. Not through
// vtkPolyDataReader, which crashes on truncated files (VTK 9.1). Throws NoInputError or
// BadDataError; counts are checked against the file's size before memory is taken.
TriangleMesh read_legacy_vtk(const std::filesystem::path& path);

}  // namespace organbake
