// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

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
