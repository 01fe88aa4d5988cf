// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/bundle/mechanics_model.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake::test {

// A tube bent into a C, its gap to the right: rings of vertices round an arc, closed at the ends,
// held opposite the gap. The last two vertices are the ends' middles, the lower end's last.
struct BentTube {
  TriangleMesh mesh;
  MechanicsModel mechanics;
};
BentTube bent_tube(double gap_rad);

}  // namespace organbake::test
