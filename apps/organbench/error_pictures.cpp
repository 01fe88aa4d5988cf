// SPDX-License-Identifier: GPL-3.0-or-later
#include "error_pictures.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "organbake/image/srgb.h"

namespace organbake {

Eigen::Vector3f heat_color(double share_of_scale) {
  if (!std::isfinite(share_of_scale)) return {0.1f, 0.2f, 0.8f};
  // A third of the scale each for red, green and blue.
  const auto ramp = [&](int third) {
    return float(std::clamp(3 * share_of_scale - third, 0.0, 1.0));
  };
  return {ramp(0), ramp(1), ramp(2)};
}

Rgb8Image heat_map(const std::vector<double>& values, int width, double scale) {
  Rgb8Image image(width, static_cast<int>(values.size()) / width);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Eigen::Vector3f color = heat_color(values[i] / scale);
    for (int c = 0; c < 3; ++c) image.pixels[3 * i + c] = srgb8_from_linear(color[c]);
  }
  return image;
}

Rgb8Image heat_map_of(const Rgb8Image& a, const Rgb8Image& b, double scale_levels) {
  std::vector<double> levels(a.pixels.size() / 3);
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    levels[i / 3] = std::max<double>(levels[i / 3], std::abs(a.pixels[i] - b.pixels[i]));
  return heat_map(levels, a.width, scale_levels);
}

Rgb8Image shrunk(const Rgb8Image& image, int most_side) {
  const int longer = std::max(image.width, image.height);
  const int block = std::max(1, (longer + most_side - 1) / most_side);
  Rgb8Image small(image.width / block, image.height / block);
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        int sum = 0;
        for (int dy = 0; dy < block; ++dy)
          for (int dx = 0; dx < block; ++dx) sum += image.at(x * block + dx, y * block + dy)[c];
        small.at(x, y)[c] = static_cast<std::uint8_t>(sum / (block * block));
      }
    }
  }
  return small;
}

}  // namespace organbake
