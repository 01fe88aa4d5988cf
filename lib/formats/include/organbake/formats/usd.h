// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/formats/textured_mesh.h"

namespace organbake {

// A recorded interaction, frame by frame, world mm: where the proxy's vertices, the tetrahedra's
// nodes (none of springs) and the textured surface's vertices lay.
struct UsdMotion {
  double frames_per_second = 60;
  std::vector<std::vector<Eigen::Vector3d>> vertices_mm, nodes_mm, surface_mm;
};

struct UsdOptions {
  std::string color_file, normal_file;  // the textures, beside the layer; the second may be empty
  // Also the schemas and attributes of Omniverse, OmniPhysicsDeformableBodyAPI and its like, of the
  // same sense.
  bool vendor_names = false;
  UsdMotion motion;  // as time samples; empty: at rest alone
};

// A bundle for physics engines, in metres, kilograms and seconds, y up (scene_from_world), as USD
// text: /Organ with the textured Surface, the Proxy with the masses of its vertices, its springs
// and anchors, and, when the bundle has them, the Body of tetrahedra with the proxy's embedding in
// it. A deformable body by the proposal for UsdPhysics (OpenUSD-proposals 111): the tetrahedra, or
// else the proxy, are simulated, the proxy collides, the surface follows from its bind pose. What
// the proposal has no place for stands in attributes of the namespace "organbake". Points are
// written to a millionth of a millimetre; USD itself reads them as floats.
std::string usd_text(const Bundle& bundle, const TexturedMesh& surface, const UsdOptions& options);

}  // namespace organbake
