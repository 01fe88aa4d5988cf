// SPDX-License-Identifier: Apache-2.0
#include "box_blur.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

// A window's mean along a row; beyond the ends is what lies there.
void box_row(const float* from, float* to, int width, int radius) {
  const auto at = [&](int x) { return from[std::clamp(x, 0, width - 1)]; };
  double sum = 0;
  for (int x = -radius; x <= radius; ++x) sum += at(x);
  for (int x = 0; x < width; ++x) {
    to[x] = static_cast<float>(sum / (2 * radius + 1));
    sum += at(x + radius + 1) - at(x - radius);
  }
}

// Down neighbouring columns, all of them at each row: alone each would load a cache line a value.
constexpr int kColumnsAtOnce = 64;
void box_columns(const float* from, float* to, int columns, int width, int height, int radius) {
  const auto row = [&](int y) { return from + std::size_t(std::clamp(y, 0, height - 1)) * width; };
  std::array<double, kColumnsAtOnce> sums = {};
  for (int y = -radius; y <= radius; ++y)
    for (int x = 0; x < columns; ++x) sums[x] += row(y)[x];
  for (int y = 0; y < height; ++y) {
    const float *const next = row(y + radius + 1), *const last = row(y - radius);
    float* const out = to + std::size_t(y) * width;
    for (int x = 0; x < columns; ++x) {
      out[x] = static_cast<float>(sums[x] / (2 * radius + 1));
      sums[x] += next[x] - last[x];
    }
  }
}

}  // namespace

std::vector<float> box_blurred(std::vector<float> channel, int width, int height, int radius) {
  constexpr int kBoxes = 3;
  std::vector<float> other(channel.size());
  for (int k = 0; k < kBoxes; ++k) {
    parallel_for(0, height, [&](int y) {
      const std::size_t row = std::size_t(y) * width;
      box_row(&channel[row], &other[row], width, radius);
    });
    parallel_for(0, (width + kColumnsAtOnce - 1) / kColumnsAtOnce, [&](int block) {
      const int x = block * kColumnsAtOnce;
      box_columns(&other[x], &channel[x], std::min(kColumnsAtOnce, width - x), width, height,
                  radius);
    });
  }
  return channel;
}

}  // namespace organbake
