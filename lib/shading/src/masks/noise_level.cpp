// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/grid_filters.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "organbake/core/median.h"

namespace organbake {

double noise_level(const Plane& intensity, const Mask& inside) {
  std::vector<float> responses;
  // Of a large image a sample is enough.
  const int step = std::max(intensity.width, intensity.height) > 256 ? 3 : 1;
  for (int y = 1; y + 1 < intensity.height; y += step)
    for (int x = 1; x + 1 < intensity.width; x += step) {
      static constexpr int kWeights[3] = {1, -2, 1};
      float sum = 0;
      bool whole = true;
      for (int dy = 0; dy < 3; ++dy)
        for (int dx = 0; dx < 3; ++dx) {
          whole = whole && inside.at(x + dx - 1, y + dy - 1);
          sum += static_cast<float>(kWeights[dx] * kWeights[dy]) *
                 intensity.at(x + dx - 1, y + dy - 1);
        }
      if (whole) responses.push_back(std::abs(sum));
    }
  // The mask's weights have a root of squares of 6; 1.4826 makes a median a standard deviation.
  return 1.4826 * median(std::move(responses)) / 6;
}

}  // namespace organbake
