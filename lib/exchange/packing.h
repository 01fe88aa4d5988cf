// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

namespace organbake {

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
