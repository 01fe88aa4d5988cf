// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "bundle/base_layer.h"
#include "bundle/mechanics_model.h"
#include "geometry/triangle_mesh.h"

namespace organbake {

// One organ as it is handed to the solver, at rest; nothing of it is kept by reference. The base
// layer (may be empty) gives the heights at which the true skin is met.
struct DeformBody {
  const TriangleMesh& proxy;
  const MechanicsModel& mechanics;
  const BaseLayer& base;
};

// Organs that lie in one world. Their proxies' vertices and faces are numbered one organ after the
// other.
using DeformBodies = std::vector<DeformBody>;

}  // namespace organbake
