// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "bundle/cameras_json.h"
#include "geometry/triangle_mesh.h"

namespace organbake {

// The bytes of a .glb file (glTF 2.0): the mesh, and each camera with its pose. glTF counts in
// metres with y up: one root node scales and turns (x left, y superior, z anterior), all below it
// is in our millimetres and axes. Cameras look along −z as glTF has them; what its pinhole cannot
// say (principal point, distortion) stands in their extras. Throws BadDataError for a mesh without
// faces.
std::string gltf_binary(const TriangleMesh& mesh, const CameraSet& cameras);

}  // namespace organbake
