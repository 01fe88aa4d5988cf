// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
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

// Twice the signed area in 1/256² pixel; negative for a face seen from its counter-clockwise side,
// because rows run down.
inline std::int64_t doubled_area(const SnappedCorner& a, const SnappedCorner& b,
                                 const SnappedCorner& c) {
  return (std::int64_t(b.x) - a.x) * (std::int64_t(c.y) - a.y) -
         (std::int64_t(c.x) - a.x) * (std::int64_t(b.y) - a.y);
}

struct SnappedTriangle {
  std::array<SnappedCorner, 3> corners;
  std::int64_t doubled_area = 0;  // 0 also for a triangle beyond reach, whose box is empty
  PixelBox box;                   // of the pixel centres that it may hold
  bool small = false;             // its products fit 32 bits, which halves its cost

  SnappedTriangle(const SnappedCorner& a, const SnappedCorner& b, const SnappedCorner& c)
      : corners{a, b, c} {
    const auto [x0, x1] = std::minmax({a.x, b.x, c.x});
    const auto [y0, y1] = std::minmax({a.y, b.y, c.y});
    if (x0 == SnappedCorner::kBeyond) return;
    doubled_area = organbake::doubled_area(a, b, c);
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
    std::array<Int, 3> row = edge;
    for (int y = 0; y < height; ++y) {
      std::array<Int, 3> e = row;
      for (int x = 0; x < width; ++x) {
        if ((e[0] | e[1] | e[2]) >= 0) inside(x, y, e);
        for (int i = 0; i < 3; ++i) e[i] += step_x[i];
      }
      for (int i = 0; i < 3; ++i) row[i] += step_y[i];
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
  const std::array<int, 3> order = swapped ? std::array{0, 2, 1} : std::array{0, 1, 2};
  const auto walk = [&]<class Int>(Int) {
    std::array<Int, 3> x, y;
    std::array<Real, 3> inverse_depth;
    for (int i = 0; i < 3; ++i) {
      inverse_depth[i] = static_cast<Real>(triangle.corners[order[i]].inverse_depth);
      x[i] = Int(triangle.corners[order[i]].x) - Int(256) * box.x0;
      y[i] = Int(triangle.corners[order[i]].y) - Int(256) * box.y0;
    }
    EdgeWalk<Int>(x, y).each(
        box.width(), box.height(), [&](int px, int py, const std::array<Int, 3>& e) {
          std::array<Real, 3> in_order;
          for (int i = 0; i < 3; ++i) in_order[i] = static_cast<Real>(e[i]) * inverse_depth[i];
          const Real inverse = 1 / (in_order[0] + in_order[1] + in_order[2]);
          for (Real& w : in_order) w *= inverse;
          // 1/z is the mean of the corners' by the edges.
          const Real depth = static_cast<Real>(e[0] + e[1] + e[2]) * inverse;
          const std::array<Real, 3> weights =
              swapped ? std::array{in_order[0], in_order[2], in_order[1]} : in_order;
          pixel(box.x0 + px, box.y0 + py, depth, weights);
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
