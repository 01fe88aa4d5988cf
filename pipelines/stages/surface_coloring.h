// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "capture/surface_color.h"
#include "geometry/triangle_mesh.h"
#include "pipelines/stage.h"
#include "raycast/ray_scene.h"

namespace organbake {

// Photographs when there are any, else the surface's own vertex colours, else the material. What
// was passed over is told in the report, and so is the choice.
std::unique_ptr<SurfaceColor> choose_color(const TriangleMesh& surface, const RayScene& scene,
                                           std::vector<Photo> photos, const Material& material,
                                           StageReport& report);

}  // namespace organbake
