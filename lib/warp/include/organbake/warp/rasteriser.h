// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/warp/view.h"

namespace organbake {

// Corners farther out than this would overflow the fixed-point edge functions; their triangles are
// not drawn.
inline constexpr double kRasterReach = 1 << 20;

// A triangle's corner on the grid of 1/256 pixel, and 1/depth for perspective: corners that several
// triangles share are snapped once.
struct SnappedCorner {
  static constexpr std::int32_t kBeyond = std::numeric_limits<std::int32_t>::min();
  std::int32_t x = kBeyond, y = 0;
  double inverse_depth = 0;

  SnappedCorner() = default;
  // In pixels.
  SnappedCorner(double at_x, double at_y, double inverse) : inverse_depth(inverse) {
    if (!(std::abs(at_x) < kRasterReach && std::abs(at_y) < kRasterReach)) return;
    x = snapped(at_x), y = snapped(at_y);
  }
  // The first pixel whose centre does not lie before a place, and the last not behind it.
  static std::int32_t center_from(std::int32_t place) { return (place + 127) >> 8; }
  static std::int32_t center_to(std::int32_t place) { return (place - 128) >> 8; }
  // Pixels, within reach. (floor is an instruction, llround a call.)
  template <class Number>
  static std::int32_t snapped(Number pixels) {
    return static_cast<std::int32_t>(std::floor(pixels * 256 + Number(0.5)));
  }
};

struct SnappedTriangle {
  std::array<SnappedCorner, 3> corners;
  // In 1/256² pixel; negative for a face seen from its counter-clockwise side, because rows run
  // down; 0 also for a triangle beyond reach, whose box is empty.
  std::int64_t doubled_area = 0;
  PixelBox box;        // of the pixel centres that it may hold
  bool small = false;  // its products fit 32 bits, which halves its cost

  SnappedTriangle(const SnappedCorner& a, const SnappedCorner& b, const SnappedCorner& c)
      : corners{a, b, c} {
    const auto [x0, x1] = std::minmax({a.x, b.x, c.x});
    const auto [y0, y1] = std::minmax({a.y, b.y, c.y});
    if (x0 == SnappedCorner::kBeyond) return;
    doubled_area = (std::int64_t(b.x) - a.x) * (std::int64_t(c.y) - a.y) -
                   (std::int64_t(c.x) - a.x) * (std::int64_t(b.y) - a.y);
    box = {SnappedCorner::center_from(x0), SnappedCorner::center_from(y0),
           SnappedCorner::center_to(x1) + 1, SnappedCorner::center_to(y1) + 1};
    constexpr std::int32_t kSmall = 60 * 256;
    small = x1 - x0 < kSmall && y1 - y0 < kSmall;
  }
};

// Edge functions of a triangle over the pixels of a box. Whole numbers, so that centres on an edge
// go to one side by the top-left rule; Int holds products of the triangle's sides in 1/256 pixel.
template <class Int>
struct EdgeWalk {
  static constexpr int kColumns = 8;        // that are looked at together
  std::array<Int, 3> edge, step_x, step_y;  // at the first pixel's centre, and per pixel

  // Corners in 1/256 pixel from the box's corner, in the order that makes the area positive. Edge i
  // lies opposite corner i, where its function is the doubled area.
  EdgeWalk(const std::array<Int, 3>& x, const std::array<Int, 3>& y) {
    for (int i = 0; i < 3; ++i) {
      const int a = (i + 1) % 3, b = (i + 2) % 3;
      const Int dx = x[b] - x[a], dy = y[b] - y[a];
      edge[i] = dx * (128 - y[a]) - dy * (128 - x[a]);
      step_x[i] = -dy * 256, step_y[i] = dx * 256;
      if (!(dy < 0 || (dy == 0 && dx > 0))) edge[i] -= 1;
    }
  }

  // inside(x, y, edges) for each pixel of the box whose centre the triangle holds.
  template <class Inside>
  void each(int width, int height, Inside&& inside) const {
    for (int x0 = 0; x0 < width; x0 += kColumns) {
      std::array<std::array<Int, kColumns>, 3> ahead;
      for (int i = 0; i < 3; ++i) {
#pragma GCC unroll 1
        for (int k = 0; k < kColumns; ++k) ahead[i][k] = edge[i] + (x0 + k) * step_x[i];
      }
      const std::uint32_t columns = (1u << std::min(width - x0, kColumns)) - 1;
      for (int y = 0; y < height; ++y) {
        std::uint32_t outside = 0;
#pragma GCC unroll 1
        for (int k = 0; k < kColumns; ++k) {
          const Int signs = ahead[0][k] | ahead[1][k] | ahead[2][k];
          outside |= static_cast<std::uint32_t>(signs < 0) << k;
        }
        for (std::uint32_t held = ~outside & columns; held != 0; held &= held - 1) {
          const int k = std::countr_zero(held);
          inside(x0 + k, y, std::array{ahead[0][k], ahead[1][k], ahead[2][k]});
        }
        for (int i = 0; i < 3; ++i) {
#pragma GCC unroll 1
          for (int k = 0; k < kColumns; ++k) ahead[i][k] += step_y[i];
        }
      }
    }
  }
};

// Visits each pixel of the window whose centre lies in the triangle, whichever way it winds:
// pixel(x, y, depth, weights) with the corners' perspective-correct weights. Triangles that share
// an edge draw each pixel along it exactly once, whatever kind of number Real is.
template <class Real = double, class Pixel>
void rasterise(const SnappedTriangle& triangle, const PixelBox& window, Pixel&& pixel) {
  const PixelBox box = intersected(triangle.box, window);
  if (box.empty() || triangle.doubled_area == 0) return;
  const bool swapped = triangle.doubled_area < 0;
  const std::array corners = {&triangle.corners[0], &triangle.corners[swapped ? 2 : 1],
                              &triangle.corners[swapped ? 1 : 2]};
  const auto walk = [&]<class Int>(Int) {
    std::array<Int, 3> x, y;
    std::array<Real, 3> inverse_depth;
    for (int i = 0; i < 3; ++i) {
      inverse_depth[i] = static_cast<Real>(corners[i]->inverse_depth);
      x[i] = Int(corners[i]->x) - Int(256) * box.x0;
      y[i] = Int(corners[i]->y) - Int(256) * box.y0;
    }
    const EdgeWalk<Int> edges(x, y);
    const Real sum = static_cast<Real>(edges.edge[0] + edges.edge[1] + edges.edge[2]);
    edges.each(box.width(), box.height(), [&](int px, int py, const std::array<Int, 3>& e) {
      std::array<Real, 3> w;
      for (int i = 0; i < 3; ++i) w[i] = static_cast<Real>(e[i]) * inverse_depth[i];
      // 1/z is the mean of the corners' by the edges, whose sum is the same everywhere.
      const Real inverse = 1 / (w[0] + w[1] + w[2]);
      for (Real& weight : w) weight *= inverse;
      pixel(box.x0 + px, box.y0 + py, sum * inverse,
            std::array{w[0], swapped ? w[2] : w[1], swapped ? w[1] : w[2]});
    });
  };
  if (triangle.small) {
    walk(std::int32_t{});
  } else {
    walk(std::int64_t{});
  }
}

// A mesh's faces as a view has them, in units of a pixel over `scale`; one that reaches before the
// near plane has no area.
inline std::vector<SnappedTriangle> project_faces(const std::vector<Face>& faces,
                                                  const std::vector<Eigen::Vector3d>& at_mm,
                                                  const View& view, double scale = 1) {
  std::vector<SnappedCorner> corners(at_mm.size());
  for (std::size_t v = 0; v < corners.size(); ++v) {
    const Eigen::Vector3d p = view.camera.camera_from_world * at_mm[v];
    if (p.z() < view.near_mm) continue;
    const Eigen::Vector2d pixel = scale * project(view.camera.intrinsics, p);
    corners[v] = {pixel.x(), pixel.y(), 1 / p.z()};
  }
  std::vector<SnappedTriangle> projected;
  projected.reserve(faces.size());
  for (const auto& [a, b, c] : faces) projected.emplace_back(corners[a], corners[b], corners[c]);
  return projected;
}

// Draws those of the faces that turn to the eye into the depths of a window: a closed surface hides
// its own inside. nearest(i, face, weights) for the window's i-th pixel, row by row, whenever a
// face lies nearer there than all before it.
template <class Nearest>
void draw_depths(const std::vector<SnappedTriangle>& faces, const PixelBox& window,
                 std::vector<float>& depth_mm, const Nearest& nearest) {
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    if (faces[f].doubled_area >= 0) continue;
    rasterise(faces[f], window, [&](int x, int y, double depth, const std::array<double, 3>& w) {
      const std::size_t i = std::size_t(y - window.y0) * window.width() + (x - window.x0);
      if (!(depth < depth_mm[i])) return;
      depth_mm[i] = static_cast<float>(depth);
      nearest(i, f, w);
    });
  }
}

}  // namespace organbake
