// SPDX-License-Identifier: GPL-3.0-or-later
// Distances to depth edges by visiting a disc round each edge: edges are few.
#include "depth_edges.h"

#include <algorithm>
#include <cmath>

namespace organbake {
namespace {

class EdgeDistances {
 public:
  EdgeDistances(int width, int height, double reach)
      : width_(width), height_(height), reach_(reach) {
    distance_.assign(std::size_t(width) * height, static_cast<float>(reach));
  }

  // An edge at (x, y) in pixels: few texels lie at edges, so visiting its disc is cheap.
  void mark(double x, double y) {
    const int left = std::max(0, static_cast<int>(x - reach_ - 0.5));
    const int right = std::min(width_ - 1, static_cast<int>(x + reach_));
    const int top = std::max(0, static_cast<int>(y - reach_ - 0.5));
    const int bottom = std::min(height_ - 1, static_cast<int>(y + reach_));
    for (int j = top; j <= bottom; ++j)
      for (int i = left; i <= right; ++i) {
        const double dx = i + 0.5 - x, dy = j + 0.5 - y;
        float& distance = distance_[std::size_t(j) * width_ + i];
        distance = std::min(distance, static_cast<float>(std::sqrt(dx * dx + dy * dy)));
      }
  }

  std::vector<float> take() { return std::move(distance_); }

 private:
  int width_, height_;
  double reach_;
  std::vector<float> distance_;
};

bool is_edge(float a, float b, double focal_px) {
  if (std::isinf(a) || std::isinf(b)) return std::isinf(a) != std::isinf(b);
  return std::abs(a - b) > kSteepestDepth * std::min(a, b) / focal_px;
}

}  // namespace

std::vector<float> depth_edge_distance(std::span<const float> depth_mm, int width, int height,
                                       double focal_px, double reach) {
  EdgeDistances distances(width, height, reach);
  const auto depth = [&](int x, int y) { return depth_mm[std::size_t(y) * width + x]; };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (x + 1 < width && is_edge(depth(x, y), depth(x + 1, y), focal_px))
        distances.mark(x + 1, y + 0.5);
      if (y + 1 < height && is_edge(depth(x, y), depth(x, y + 1), focal_px))
        distances.mark(x + 0.5, y + 1);
      if (std::isinf(depth(x, y))) continue;
      if (x == 0 || x + 1 == width) distances.mark(x == 0 ? 0 : width, y + 0.5);
      if (y == 0 || y + 1 == height) distances.mark(x + 0.5, y == 0 ? 0 : height);
    }
  std::vector<float> result = distances.take();
  for (std::size_t i = 0; i < result.size(); ++i)
    if (std::isinf(depth_mm[i])) result[i] = 0;
  return result;
}

}  // namespace organbake
