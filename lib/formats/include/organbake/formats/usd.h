// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/bundle/bundle.h"
#include "organbake/formats/textured_mesh.h"

namespace organbake {

// A bundle for physics engines, in metres, kilograms and seconds, y up (scene_from_world), as USD
// text: /Organ with the textured Surface, the Proxy with the masses of its vertices, its
// springs and anchors, and, when the bundle has them, the Body of tetrahedra with the proxy's
// embedding in it. Deformable bodies by the USD Physics working group's proposal under the names in
// which it is published today, OmniPhysicsDeformableBodyAPI and its like; what that has no place
// for stands in attributes of the namespace "organbake". The textures lie beside it.
std::string usd_text(const Bundle& bundle, const TexturedMesh& surface,
                     const std::string& color_file, const std::string& normal_file);

}  // namespace organbake
