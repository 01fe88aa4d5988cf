// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>

#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

// Every second pixel of every second row, for what is found by windows much larger than a pixel.
template <class T>
Grid<T> every_second(const Grid<T>& grid) {
  Grid<T> half((grid.width + 1) / 2, (grid.height + 1) / 2);
  for (int y = 0; y < half.height; ++y)
    for (int x = 0; x < half.width; ++x) half.at(x, y) = grid.at(2 * x, 2 * y);
  return half;
}

inline Rgb8Image every_second(const Rgb8Image& image) {
  Rgb8Image half((image.width + 1) / 2, (image.height + 1) / 2);
  for (int y = 0; y < half.height; ++y)
    for (int x = 0; x < half.width; ++x) std::copy_n(image.at(2 * x, 2 * y), 3, half.at(x, y));
  return half;
}

}  // namespace organbake
