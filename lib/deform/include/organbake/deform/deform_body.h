// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "organbake/bundle/base_layer.h"
#include "organbake/bundle/mechanics_model.h"
#include "organbake/geometry/smooth_skin.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// One organ as it is handed to the solver, at rest; nothing of it is kept by reference. The
// true skin is met on the smooth skin over the proxy or, without one, at the heights of the base
// layer over it, which may be empty.
struct DeformBody {
  const TriangleMesh& proxy;
  const MechanicsModel& mechanics;
  const BaseLayer& base;
  const SmoothSkin* skin = nullptr;  // the base layer then lies over it and is not looked at
};

// Organs that lie in one world. Their proxies' vertices and faces are numbered one organ after the
// other.
using DeformBodies = std::vector<DeformBody>;

}  // namespace organbake
