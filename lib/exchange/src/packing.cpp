// SPDX-License-Identifier: GPL-3.0-or-later
#include "atlas.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace organbake {
namespace {

// Whether all fit; `corners` then says where.
bool shelved(const std::vector<Eigen::Vector2d>& sizes, double scale, int margin, int side,
             std::vector<Eigen::Vector2i>& corners) {
  std::vector<Eigen::Vector2i> cells;
  for (const Eigen::Vector2d& size : sizes)
    cells.push_back((scale * size).array().ceil().cast<int>().matrix() +
                    Eigen::Vector2i::Constant(2 * margin));
  std::vector<std::size_t> order(sizes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return cells[a].y() > cells[b].y(); });
  corners.resize(sizes.size());
  int left = 0, top = 0, shelf = 0;
  for (const std::size_t i : order) {
    if (left + cells[i].x() > side) left = 0, top += shelf, shelf = 0;
    shelf = std::max(shelf, cells[i].y());
    if (left + cells[i].x() > side || top + shelf > side) return false;
    corners[i] = {left + margin, top + margin};
    left += cells[i].x();
  }
  return true;
}

}  // namespace

PackedRectangles pack_rectangles(const std::vector<Eigen::Vector2d>& sizes, int margin, int side,
                                 double largest_scale) {
  PackedRectangles packed;
  if (shelved(sizes, largest_scale, margin, side, packed.corners)) {
    packed.scale = largest_scale;
    return packed;
  }
  constexpr int kHalvings = 24;
  double fits = 0, too_large = largest_scale;
  for (int i = 0; i < kHalvings; ++i) {
    const double scale = 0.5 * (fits + too_large);
    std::vector<Eigen::Vector2i> corners;
    if (shelved(sizes, scale, margin, side, corners)) {
      fits = scale;
      packed.corners = std::move(corners);
    } else {
      too_large = scale;
    }
  }
  packed.scale = fits;
  return packed;
}

}  // namespace organbake
