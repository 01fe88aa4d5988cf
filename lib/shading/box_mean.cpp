// SPDX-License-Identifier: GPL-3.0-or-later
#include "shading/box_mean.h"

#include <algorithm>
#include <vector>

namespace organbake {
namespace {

struct Sum {
  float value = 0, count = 0;
};

}  // namespace

Plane box_mean(const Plane& plane, const Mask& inside, int radius) {
  const int width = plane.width, height = plane.height;
  Grid<Sum> rows(width, height);
  for (int y = 0; y < height; ++y) {
    Sum running;
    const auto add = [&](int x, float sign) {
      if (x < 0 || x >= width || !inside.at(x, y)) return;
      running.value += sign * plane.at(x, y);
      running.count += sign;
    };
    for (int x = 0; x < std::min(radius, width); ++x) add(x, 1);
    for (int x = 0; x < width; ++x) {
      add(x + radius, 1);
      add(x - radius - 1, -1);
      rows.at(x, y) = running;
    }
  }
  Plane mean(width, height);
  std::vector<Sum> running(static_cast<std::size_t>(width));
  const auto add = [&](int y, float sign) {
    if (y < 0 || y >= height) return;
    for (int x = 0; x < width; ++x) {
      running[x].value += sign * rows.at(x, y).value;
      running[x].count += sign * rows.at(x, y).count;
    }
  };
  for (int y = 0; y < std::min(radius, height); ++y) add(y, 1);
  for (int y = 0; y < height; ++y) {
    add(y + radius, 1);
    add(y - radius - 1, -1);
    for (int x = 0; x < width; ++x)
      mean.at(x, y) = running[x].count > 0.5F ? running[x].value / running[x].count : 0;
  }
  return mean;
}

}  // namespace organbake
