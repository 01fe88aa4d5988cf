// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/contour/contour.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "contour_door.h"
#include "organbake/core/files.h"

namespace organbake {
namespace {

TriangleMesh by_module(const ContouredGrid& grid) {
  // VTK reports a grid without cells as an error.
  if (std::ranges::min(grid.size) < 2) return {};
  static const auto door = reinterpret_cast<decltype(&organbake_contour)>(
      module_door("organbake_contouring", "organbake_contour"));
  TriangleMesh surface;
  door(grid, surface);
  return surface;
}

}  // namespace

double least_distance_to_level(const std::array<int, 3>& size) {
  const auto side = static_cast<unsigned>(std::ranges::max(size));
  // The spacing of single-precision numbers just below the next power of two; half as much again.
  return 1.5 * std::ldexp(static_cast<double>(std::bit_ceil(side)), -24);
}

TriangleMesh contour(std::span<const std::int16_t> values, const std::array<int, 3>& size,
                     double level) {
  return by_module({values, {}, size, level});
}

TriangleMesh contour(std::span<const float> values, const std::array<int, 3>& size, double level) {
  return by_module({{}, values, size, level});
}

}  // namespace organbake
