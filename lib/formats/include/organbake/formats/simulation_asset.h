// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/formats/textured_mesh.h"

namespace organbake {

// The mass that each node of a solid carries, a quarter of each of its tetrahedra, kg.
std::vector<double> node_masses_kg(const TetrahedralBody& body, double density_kg_per_m3);

// A bundle for physics engines, in metres, kilograms and seconds, y up (scene_from_world).

// USD as text: /Organ with the textured Surface, the Proxy with the masses of its vertices, its
// springs and anchors, and, when the bundle has them, the Body of tetrahedra with the proxy's
// embedding in it. Deformable bodies by the USD Physics working group's proposal under the names in
// which it is published today, OmniPhysicsDeformableBodyAPI and its like; what that has no place
// for stands in attributes of the namespace "organbake". The textures lie beside it.
std::string usd_text(const Bundle& bundle, const TexturedMesh& surface,
                     const std::string& color_file, const std::string& normal_file);

// A scene of SOFA (XML): finite elements on the tetrahedra where there are any, else the proxy's
// springs; anchors; the proxy as collision model, and the surface, which lies beside it as OBJ,
// both mapped to what moves.
std::string sofa_text(const Bundle& bundle, const std::string& surface_file,
                      const std::string& color_file);

}  // namespace organbake
