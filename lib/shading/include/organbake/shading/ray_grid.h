// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/geometry/camera.h"

namespace organbake {

// The rays of an undistorted camera's pixels in normalised coordinates: (x, y, 1).
struct RayGrid {
  int width = 0;
  int height = 0;
  double step_x = 0, step_y = 0;  // between neighbours: 1/fx, 1/fy
  double left = 0, top = 0;       // of the first pixel's centre

  double x(int column) const { return left + column * step_x; }
  double y(int row) const { return top + row * step_y; }
};

inline RayGrid ray_grid(const Intrinsics& camera) {
  return {camera.width,
          camera.height,
          1 / camera.fx,
          1 / camera.fy,
          (0.5 - camera.cx) / camera.fx,
          (0.5 - camera.cy) / camera.fy};
}

// The grid of half the size whose pixels cover 2×2 of this one (the last row and column fewer).
inline RayGrid halved(const RayGrid& fine) {
  return {(fine.width + 1) / 2, (fine.height + 1) / 2,         2 * fine.step_x,
          2 * fine.step_y,      fine.left + 0.5 * fine.step_x, fine.top + 0.5 * fine.step_y};
}

}  // namespace organbake
