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

// A piece of a surface that is laid flat by looking at it along one axis.
struct Chart {
  Eigen::Vector3d axis, u, v;  // unit, right-handed: from outside u runs right and v upward
  std::vector<std::uint32_t> faces;

  Eigen::Vector2d flat(const Eigen::Vector3d& point) const { return {u.dot(point), v.dot(point)}; }
};

// Cuts a surface into charts: connected faces, none turned from its chart's axis by more than 50°
// (so nothing shrinks to less than 0.64 of its length) and no two over each other when laid flat.
// Every face with an area is in exactly one; u and v lie along the chart's own longest and shortest
// extent, for tight packing. Deterministic.
std::vector<Chart> cut_into_charts(const TriangleMesh& mesh);

// Where rectangles lie in a square, and how much they were scaled for it.
struct PackedRectangles {
  double scale = 0;                      // of their sizes; 0: they don't fit at any
  std::vector<Eigen::Vector2i> corners;  // top left, of the rectangle without its margin
};

// Packs rectangles, each with a margin all round, into a square of `side` cells: at the largest
// scale up to `largest_scale` that is found. By shelves, the tallest first. Deterministic.
PackedRectangles pack_rectangles(const std::vector<Eigen::Vector2d>& sizes, int margin, int side,
                                 double largest_scale);

}  // namespace organbake
