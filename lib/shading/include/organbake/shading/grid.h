// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace organbake {

// One plane of numbers, row-major, top row first.
template <class T>
struct Grid {
  int width = 0;
  int height = 0;
  std::vector<T> values;

  Grid() = default;
  Grid(int w, int h, T fill = T()) : width(w), height(h), values(std::size_t(w) * h, fill) {}
  std::size_t size() const { return values.size(); }
  std::size_t index(int x, int y) const { return std::size_t(y) * width + x; }
  T& at(int x, int y) { return values[index(x, y)]; }
  const T& at(int x, int y) const { return values[index(x, y)]; }
  bool operator==(const Grid&) const = default;
};

using Plane = Grid<float>;
// Non-zero = the pixel counts.
using Mask = Grid<std::uint8_t>;

}  // namespace organbake
