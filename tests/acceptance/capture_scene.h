// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The phantom organ, coloured, its proxy, and virtual cameras round it.
struct CaptureScene {
  TriangleMesh surface, proxy;
  std::vector<PosedCamera> cameras;
};
CaptureScene capture_scene(int cameras, int map_size);

}  // namespace organbake
