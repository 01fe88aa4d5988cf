// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/bundle/bundle.h"
#include "organbake/exchange/map_sampler.h"
#include "organbake/formats/textured_mesh.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/raycast/ray_scene.h"

namespace organbake {

// The surface as fine as a bundle has it: the base layer for its shape, the maps for what they show
// of it. Thread-safe after construction.
class FineSurface {
 public:
  struct Appearance {
    Eigen::Vector3d normal;       // of the base layer, smooth over its faces
    Eigen::Vector3d fine_normal;  // as the maps have it, where they show it
    Eigen::Vector3f color;        // linear
  };

  FineSurface(const Bundle& bundle, TriangleMesh base);
  const TriangleMesh& mesh() const { return base_; }
  double texel_mm() const { return maps_.texel_mm(); }
  // At the closest point of the surface.
  Appearance at(const Eigen::Vector3d& point) const;

 private:
  TriangleMesh base_;
  std::vector<Eigen::Vector3d> normals_;
  RayScene scene_;
  MapSampler maps_;
};

// Fills a mesh's colour and normal maps, side × side texels: every texel whose middle lies in a
// face or within a texel and a half of one from the fine surface at that place, the rest from its
// neighbours. `light`: that the colours are freed from, or null. Spreads over TBB's threads.
void bake_atlas(const FineSurface& fine, const Lighting* light, int side, TexturedMesh& mesh);

}  // namespace organbake
