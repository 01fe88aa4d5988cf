// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

// What one camera of a bundle sees, cut out of its ground.
struct CutOut {
  Rgb8Image color;                  // sRGB, not multiplied by alpha; black where alpha is 0
  std::vector<std::uint8_t> alpha;  // how much of the pixel the organ covers
  std::vector<float> depth_mm;      // planar z; 0 where the pixel's centre sees nothing
};

// Colours and depths are the maps'. The outline is the base layer's, over 4 × 4 rays a pixel; what
// the maps leave out beside it (they keep nothing that they see at a grazing angle) is filled from
// there, so that the organ ends where its surface does. base: base_surface() of the bundle, `scene`
// its search tree. Spreads over TBB's threads.
CutOut cut_out(const CameraMaps& maps, const PosedCamera& camera, const TriangleMesh& base,
               const RayScene& scene);

// White where the organ covers at least half of a pixel: an 8-bit PNG.
std::string mask_png(const CutOut& picture);
// Whole counts of unit_mm in 16 bits, 0 for nothing.
std::string depth_png(const CutOut& picture, double unit_mm);
// The finest unit of 1, 2 or 5 · 10ⁿ mm in which that depth fits into 16 bits.
double depth_unit_mm(double largest_depth_mm);

}  // namespace organbake
