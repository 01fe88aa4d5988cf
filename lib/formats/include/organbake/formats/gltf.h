// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/bundle/cameras_json.h"
#include "organbake/formats/textured_mesh.h"

namespace organbake {

// The bytes of a .glb file (glTF 2.0): the mesh with its textures inside, and each camera with its
// pose, in glTF's metres and y up (scene_from_world). Cameras look along −z as glTF has them; what
// its pinhole cannot say (principal point, distortion) stands in their extras. Throws BadDataError
// for a mesh without faces.
std::string gltf_binary(const TexturedMesh& mesh, const CameraSet& cameras);

}  // namespace organbake
