// SPDX-License-Identifier: GPL-3.0-or-later
#include "shading/instruments.h"

#include <algorithm>

#include "shading/box_mean.h"
#include "shading/every_second.h"
#include "shading/masks.h"

namespace organbake {
namespace {

// Of the smoothed frame: tissue reflects red; steel and plastic all colours alike.
constexpr float kGreySaturation = 0.20F;
constexpr float kLeastValue = 25;

Plane channel(const Rgb8Image& frame, int c) {
  Plane plane(frame.width, frame.height);
  for (std::size_t k = 0; k < plane.size(); ++k) plane.values[k] = frame.pixels[3 * k + c];
  return plane;
}

// The regions that reach the rim: instruments come in from outside, fat, film and blown highlights
// lie in the middle.
Mask entering(const Mask& regions, const Mask& middle) {
  constexpr int kRim = 2;
  Mask rim(regions.width, regions.height);
  for (int y = 0; y < rim.height; ++y) {
    for (int x = 0; x < rim.width; ++x) {
      const bool edge = x < kRim || y < kRim || x >= rim.width - kRim || y >= rim.height - kRim;
      rim.at(x, y) = edge || !middle.at(x, y);
    }
  }
  return regions_touching(regions, rim);
}

}  // namespace

Mask find_instruments(const Rgb8Image& frame, const Mask& inside) {
  // Instruments are large: half the resolution shows them as well, in a quarter of the time.
  constexpr int kEnough = 400;
  if (frame.width > kEnough)
    return expanded(find_instruments(every_second(frame), every_second(inside)), inside);
  const int side = std::max(frame.width, frame.height);
  const int radius = std::max(1, side / 200);
  const Plane red = box_mean(channel(frame, 0), inside, radius);
  const Plane green = box_mean(channel(frame, 1), inside, radius);
  const Plane blue = box_mean(channel(frame, 2), inside, radius);
  Mask grey(frame.width, frame.height);
  for (std::size_t k = 0; k < grey.size(); ++k) {
    const float most = std::max({red.values[k], green.values[k], blue.values[k]});
    const bool metal =
        most > kLeastValue &&
        red.values[k] - std::max(green.values[k], blue.values[k]) < kGreySaturation * most &&
        red.values[k] - blue.values[k] < kGreySaturation * most;
    grey.values[k] = inside.values[k] && metal;
  }
  // Opening and closing: what is left is large, whole, and a little larger than it was.
  const int opening = std::max(2, side / 100);
  const Mask core = entering(eroded(grey, opening), eroded(inside, 2 * opening));
  return common(dilated(core, opening + radius + 1), inside);
}

}  // namespace organbake
