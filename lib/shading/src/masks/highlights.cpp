// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/masks.h"

#include <algorithm>
#include <cmath>

#include "organbake/shading/grid_filters.h"

namespace organbake {
namespace {

constexpr float kSaturated = 250;
// A mirror reflection adds white light: the least of the three channels rises most against its
// surroundings.
constexpr float kWhiter = 32, kWhiterShare = 0.6F;

Plane least_channel(const Rgb8Image& frame) {
  Plane least(frame.width, frame.height);
  for (std::size_t k = 0; k < least.size(); ++k)
    least.values[k] =
        std::min({frame.pixels[3 * k], frame.pixels[3 * k + 1], frame.pixels[3 * k + 2]});
  return least;
}

}  // namespace

Mask find_highlights(const Rgb8Image& frame, const Mask& inside) {
  const Plane white = least_channel(frame);
  const int side = std::max(frame.width, frame.height);
  // Twice: the first mean is raised by the highlights themselves.
  Mask usual = inside, found(frame.width, frame.height);
  for (int pass = 0; pass < 2; ++pass) {
    const Plane around = box_mean(white, usual, std::max(3, side / 20));
    for (std::size_t k = 0; k < white.size(); ++k) {
      const float rise = white.values[k] - around.values[k];
      const bool bright =
          white.values[k] >= kSaturated ||
          (rise > kWhiter && rise > kWhiterShare * std::max(around.values[k], 20.F));
      found.values[k] = inside.values[k] && bright;
      usual.values[k] = inside.values[k] && !found.values[k];
    }
  }
  return common(dilated(found, std::max(1, side / 400)), inside);
}

}  // namespace organbake
