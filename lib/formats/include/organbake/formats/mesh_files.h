// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/core/run_context.h"
#include "organbake/formats/mesh_frame.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Reads a surface mesh by its name's ending: .ply, .obj, .stl, .off, .vtk (legacy polydata), .vtp,
// .vtu (the outside of its cells), .glb, .gltf. Polygons become triangles; colours become linear
// ones; vertices of open edges that coincide are welded, and their number is told.
// The coordinates become the world's, millimetres and LPS. What the file says of them holds
// (frame_in_header); where it says nothing, `told`; where that does not either, glTF is in metres
// with y up, and all others are in the world's own.
// Closed pieces that are wound inside out are turned (turn_outward), and it is warned of, as of
// sizes that no organ has. Throws NoInputError, UsageError (unknown ending) or BadDataError
// (damaged, no faces, bad index, NaN).
TriangleMesh read_mesh(const std::filesystem::path& path, const MeshFrame& told = {},
                       const RunContext& context = {});
// The same, with the frame that its coordinates were taken in.
TriangleMesh read_mesh(const std::filesystem::path& path, const MeshFrame& told,
                       const RunContext& context, MeshFrame& taken);

}  // namespace organbake
