// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "organbake/capture/surface_color.h"
#include "organbake/capture/traced_surface.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

struct MaterialPicture {
  Rgb8Image color;                    // on black
  std::vector<std::uint8_t> covered;  // by any of a pixel's rays
};

// Pictures of a surface in capture's default material, which is a formula, so that no map and no
// mesh limits its colours: 16 rays a pixel, those that miss count as the background.
class MaterialTruth {
 public:
  // The surface must last.
  explicit MaterialTruth(const TriangleMesh& surface);

  MaterialPicture draw(const PosedCamera& camera) const;

 private:
  void draw_row(const PosedCamera& camera, int y, MaterialPicture& picture) const;

  RayScene rays_;
  SmoothNormals normals_;
  std::unique_ptr<SurfaceColor> color_;
};

}  // namespace organbake
