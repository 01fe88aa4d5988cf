// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "warp/pixel_box.h"

namespace organbake {

// A triangle's corner in the picture: pixels, and 1/depth for perspective.
struct RasterCorner {
  double x = 0, y = 0, inverse_depth = 0;
};

// Corners farther out than this would overflow the fixed-point edge functions; clip_triangle()
// keeps them inside.
inline constexpr double kRasterReach = 1 << 20;

// Twice the signed area in the picture; negative for a face seen from its counter-clockwise side,
// because rows run down.
inline double doubled_area(const std::array<RasterCorner, 3>& t) {
  return (t[1].x - t[0].x) * (t[2].y - t[0].y) - (t[2].x - t[0].x) * (t[1].y - t[0].y);
}

// Visits each pixel of the window whose centre lies in the triangle, whichever way it winds:
// pixel(x, y, depth, weights) with the corners' perspective-correct weights. Corners are snapped to
// 1/256 pixel and centres on an edge go to one side by the top-left rule, so triangles that share
// an edge draw each pixel along it exactly once.
template <class Pixel>
void rasterise(const std::array<RasterCorner, 3>& triangle, const PixelBox& window, Pixel&& pixel) {
  constexpr std::int64_t kOne = 256;
  std::array<std::int64_t, 3> x, y;
  for (int i = 0; i < 3; ++i) {
    if (!(std::abs(triangle[i].x) < kRasterReach && std::abs(triangle[i].y) < kRasterReach)) return;
    x[i] = std::llround(triangle[i].x * kOne), y[i] = std::llround(triangle[i].y * kOne);
  }
  std::array<int, 3> order = {0, 1, 2};
  std::int64_t area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
  if (area == 0) return;
  if (area < 0)
    std::swap(order[1], order[2]), std::swap(x[1], x[2]), std::swap(y[1], y[2]), area = -area;
  const auto first_center = [](std::int64_t v) { return (v + kOne / 2 - 1) >> 8; };
  const auto [low_x, high_x] = std::minmax({x[0], x[1], x[2]});
  const auto [low_y, high_y] = std::minmax({y[0], y[1], y[2]});
  const std::int64_t x0 = std::max<std::int64_t>(window.x0, first_center(low_x));
  const std::int64_t y0 = std::max<std::int64_t>(window.y0, first_center(low_y));
  const std::int64_t x1 = std::min<std::int64_t>(window.x1, first_center(high_x) + 1);
  const std::int64_t y1 = std::min<std::int64_t>(window.y1, first_center(high_y) + 1);
  if (x0 >= x1 || y0 >= y1) return;
  // Edge i lies opposite corner i; its function is positive inside and grows to `area` at corner i.
  std::array<std::int64_t, 3> edge, step_x, step_y, bias;
  for (int i = 0; i < 3; ++i) {
    const int a = (i + 1) % 3, b = (i + 2) % 3;
    const std::int64_t dx = x[b] - x[a], dy = y[b] - y[a];
    edge[i] = dx * (y0 * kOne + kOne / 2 - y[a]) - dy * (x0 * kOne + kOne / 2 - x[a]);
    step_x[i] = -dy * kOne, step_y[i] = dx * kOne;
    bias[i] = dy < 0 || (dy == 0 && dx > 0) ? 0 : -1;
  }
  std::array<double, 3> scale;
  for (int i = 0; i < 3; ++i)
    scale[i] = triangle[order[i]].inverse_depth / static_cast<double>(area);
  for (std::int64_t py = y0; py < y1; ++py) {
    std::array<std::int64_t, 3> e = edge;
    for (std::int64_t px = x0; px < x1; ++px) {
      if (((e[0] + bias[0]) | (e[1] + bias[1]) | (e[2] + bias[2])) >= 0) {
        std::array<double, 3> weights;
        double sum = 0;
        for (int i = 0; i < 3; ++i) {
          const double w = static_cast<double>(e[i]) * scale[i];
          weights[order[i]] = w, sum += w;
        }
        const double depth = 1 / sum;
        for (double& w : weights) w *= depth;
        pixel(static_cast<int>(px), static_cast<int>(py), depth, weights);
      }
      for (int i = 0; i < 3; ++i) e[i] += step_x[i];
    }
    for (int i = 0; i < 3; ++i) edge[i] += step_y[i];
  }
}

}  // namespace organbake
