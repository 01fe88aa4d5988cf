// SPDX-License-Identifier: GPL-3.0-or-later
#include "report/error_pictures.h"

#include <algorithm>
#include <cmath>

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

}  // namespace organbake
