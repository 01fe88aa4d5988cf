// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "organbake/bundle/base_layer.h"
#include "organbake/bundle/bundle.h"
#include "organbake/capture/surface_color.h"
#include "organbake/capture/traced_surface.h"
#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"

namespace organbake {

struct BaseLayerScene {
  const TriangleMesh& proxy;
  const TracedSurface& surface;
  const SurfaceColor& color;
  const std::vector<PosedCamera>& cameras;
  const std::vector<CameraMaps>& maps;  // finished
  double reach_mm;                      // along a shell line, both ways
};

// Every node's height is where its shell line meets the surface, of all meetings the nearest to
// the proxy whose normal agrees; where there is none, the height of the closest surface point.
// Faces that share a vertex or an edge get the same values there, so the layer has no cracks.
BaseLayer bake_base_layer(const BaseLayerScene& scene, double step_mm, const RunContext& context);

}  // namespace organbake
