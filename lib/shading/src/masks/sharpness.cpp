// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/frame_preparation.h"

#include <cstdlib>
#include <limits>

namespace organbake {

double sharpness(const Rgb8Image& frame) {
  double sum = 0;
  for (int y = 1; y + 1 < frame.height; ++y)
    for (int x = 1; x + 1 < frame.width; ++x) {
      const double l = 4 * frame.at(x, y)[1] - frame.at(x - 1, y)[1] - frame.at(x + 1, y)[1] -
                       frame.at(x, y - 1)[1] - frame.at(x, y + 1)[1];
      sum += l * l;
    }
  return sum / (double(frame.width) * frame.height + 1e-9);
}

double mean_difference(const Rgb8Image& a, const Rgb8Image& b) {
  if (a.width != b.width || a.height != b.height) return std::numeric_limits<double>::infinity();
  double sum = 0;
  const std::size_t pixels = a.pixels.size() / 3;
  for (std::size_t k = 0; k < pixels; ++k)
    sum += std::abs(int(a.pixels[3 * k + 1]) - int(b.pixels[3 * k + 1]));
  return sum / (static_cast<double>(pixels) + 1e-9);
}

}  // namespace organbake
