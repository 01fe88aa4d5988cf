// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The triangles of a glTF 2.0 file (.glb, or .gltf with its buffers inside or beside it), in metres
// and on its own axes: every mesh of the scene with its nodes' transforms; strips and fans become
// triangles, points and lines are passed over, COLOR_0 is linear by glTF's definition. Skins, morph
// targets and animations are not followed. Throws NoInputError (a buffer's file that is missing),
// or BadDataError, also for extensions that pack the numbers away (Draco, meshopt).
TriangleMesh read_gltf(const std::filesystem::path& path);

}  // namespace organbake
