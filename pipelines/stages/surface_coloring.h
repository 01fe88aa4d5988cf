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

// Gives every vertex the colour that the images show there, so that the surface can be compared
// with what is played.
void color_vertices(TriangleMesh& surface, const SurfaceColor& color);

}  // namespace organbake
