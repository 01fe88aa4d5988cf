// SPDX-License-Identifier: GPL-3.0-or-later
#include "shading/field_of_view.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace organbake {
namespace {

constexpr int kBlack = 16;  // of the brightest channel: what coding leaves of a black border

// Labels the 4-connected region of `value` that holds (x, y); returns its size.
std::size_t flood(const Mask& mask, std::uint8_t value, int x, int y, Grid<std::uint32_t>& label,
                  std::uint32_t name) {
  std::vector<std::pair<int, int>> open = {{x, y}};
  label.at(x, y) = name;
  std::size_t size = 0;
  while (!open.empty()) {
    const auto [cx, cy] = open.back();
    open.pop_back();
    ++size;
    const std::pair<int, int> neighbours[4] = {
        {cx - 1, cy}, {cx + 1, cy}, {cx, cy - 1}, {cx, cy + 1}};
    for (const auto& [nx, ny] : neighbours) {
      if (nx < 0 || ny < 0 || nx >= mask.width || ny >= mask.height) continue;
      if (mask.at(nx, ny) != value || label.at(nx, ny)) continue;
      label.at(nx, ny) = name;
      open.emplace_back(nx, ny);
    }
  }
  return size;
}

Mask largest_region(const Mask& mask) {
  Grid<std::uint32_t> label(mask.width, mask.height);
  std::uint32_t names = 0, best = 0;
  std::size_t largest = 0;
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x) {
      if (!mask.at(x, y) || label.at(x, y)) continue;
      const std::size_t size = flood(mask, mask.at(x, y), x, y, label, ++names);
      if (size > largest) {
        largest = size;
        best = names;
      }
    }
  Mask region(mask.width, mask.height);
  for (std::size_t k = 0; k < mask.size(); ++k)
    region.values[k] = best != 0 && label.values[k] == best;
  return region;
}

// Whatever is not joined to the frame's edge through zeros becomes non-zero.
void close_holes(Mask& mask) {
  Grid<std::uint32_t> outside(mask.width, mask.height);
  const auto seed = [&](int x, int y) {
    if (!mask.at(x, y) && !outside.at(x, y)) flood(mask, 0, x, y, outside, 1);
  };
  for (int x = 0; x < mask.width; ++x) {
    seed(x, 0);
    seed(x, mask.height - 1);
  }
  for (int y = 0; y < mask.height; ++y) {
    seed(0, y);
    seed(mask.width - 1, y);
  }
  for (std::size_t k = 0; k < mask.size(); ++k)
    mask.values[k] = mask.values[k] || !outside.values[k];
}

// A pixel is 1 where any (or, by the complement, all) of the window is; rows, then columns.
Mask windowed_max(const Mask& mask, int radius) {
  Mask rows(mask.width, mask.height), both = rows;
  for (int y = 0; y < mask.height; ++y) {
    int last = -radius - 1;  // column of the last 1
    for (int x = 0; x < mask.width + radius; ++x) {
      if (x < mask.width && mask.at(x, y)) last = x;
      const int centre = x - radius;
      if (centre >= 0) rows.at(centre, y) = last >= centre - radius && last >= 0;
    }
  }
  for (int x = 0; x < mask.width; ++x) {
    int last = -radius - 1;
    for (int y = 0; y < mask.height + radius; ++y) {
      if (y < mask.height && rows.at(x, y)) last = y;
      const int centre = y - radius;
      if (centre >= 0) both.at(x, centre) = last >= centre - radius && last >= 0;
    }
  }
  return both;
}

}  // namespace

Mask dilated(const Mask& mask, int radius) {
  if (radius <= 0 || mask.size() == 0) return mask;
  return windowed_max(mask, radius);
}

Mask eroded(const Mask& mask, int radius) {
  Mask inverse = mask;
  for (std::uint8_t& value : inverse.values) value = !value;
  inverse = dilated(inverse, radius);
  for (std::uint8_t& value : inverse.values) value = !value;
  return inverse;
}

Mask field_of_view(const Rgb8Image& frame, int margin_px) {
  Mask lit(frame.width, frame.height);
  std::size_t dark = 0;
  for (int y = 0; y < frame.height; ++y)
    for (int x = 0; x < frame.width; ++x) {
      const std::uint8_t* p = frame.at(x, y);
      lit.at(x, y) = std::max({p[0], p[1], p[2]}) > kBlack;
      dark += !lit.at(x, y);
    }
  if (dark == lit.size() || dark == 0) return lit;
  Mask inside = largest_region(lit);
  close_holes(inside);
  // The frame's own edge is no stop: only the inner border shrinks.
  return eroded(inside, margin_px);
}

}  // namespace organbake
