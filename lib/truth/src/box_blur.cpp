// SPDX-License-Identifier: Apache-2.0
#include "box_blur.h"

#include <algorithm>
#include <cstddef>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

// A window's mean along a line of `count` values, `step` apart.
void box_line(const float* from, float* to, int count, std::size_t step, int radius) {
  const auto at = [&](int i) { return from[std::size_t(std::clamp(i, 0, count - 1)) * step]; };
  double sum = 0;
  for (int i = -radius; i <= radius; ++i) sum += at(i);
  for (int i = 0; i < count; ++i) {
    to[std::size_t(i) * step] = static_cast<float>(sum / (2 * radius + 1));
    sum += at(i + radius + 1) - at(i - radius);
  }
}

}  // namespace

std::vector<float> box_blurred(std::vector<float> channel, int width, int height, int radius) {
  constexpr int kBoxes = 3;
  std::vector<float> other(channel.size());
  for (int k = 0; k < kBoxes; ++k) {
    parallel_for(0, height, [&](int y) {
      const std::size_t row = std::size_t(y) * width;
      box_line(&channel[row], &other[row], width, 1, radius);
    });
    parallel_for(0, width, [&](int x) {
      box_line(&other[x], &channel[x], height, std::size_t(width), radius);
    });
  }
  return channel;
}

}  // namespace organbake
