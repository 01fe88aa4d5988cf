// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/masks.h"

#include <algorithm>

#include "masks/every_second.h"
#include "organbake/shading/grid_filters.h"

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

// Lit pixels, and those of them that are as grey as metal, of the smoothed frame.
struct GreyPixels {
  Mask grey;
  std::size_t grey_count = 0, lit_count = 0;
};

GreyPixels grey_pixels(const Rgb8Image& frame, const Mask& inside, int radius) {
  const Plane red = box_mean(channel(frame, 0), inside, radius);
  const Plane green = box_mean(channel(frame, 1), inside, radius);
  const Plane blue = box_mean(channel(frame, 2), inside, radius);
  GreyPixels found{Mask(frame.width, frame.height)};
  for (std::size_t k = 0; k < found.grey.size(); ++k) {
    const float most = std::max({red.values[k], green.values[k], blue.values[k]});
    if (!inside.values[k] || most <= kLeastValue) continue;
    ++found.lit_count;
    found.grey.values[k] =
        red.values[k] - std::max(green.values[k], blue.values[k]) < kGreySaturation * most &&
        red.values[k] - blue.values[k] < kGreySaturation * most;
    found.grey_count += found.grey.values[k];
  }
  return found;
}

int smoothing_radius(const Rgb8Image& frame) {
  return std::max(1, std::max(frame.width, frame.height) / 200);
}

// Instruments are large: half the resolution shows them as well, in a quarter of the time.
constexpr int kEnough = 400;

}  // namespace

Mask find_instruments(const Rgb8Image& frame, const Mask& inside) {
  if (frame.width > kEnough)
    return expanded(find_instruments(every_second(frame), every_second(inside)), inside);
  const int radius = smoothing_radius(frame);
  const Mask grey = grey_pixels(frame, inside, radius).grey;
  // Opening and closing: what is left is large, whole, and a little larger than it was.
  const int opening = std::max(2, std::max(frame.width, frame.height) / 100);
  const Mask core = entering(eroded(grey, opening), eroded(inside, 2 * opening));
  return common(dilated(core, opening + radius + 1), inside);
}

bool is_colourless(const Rgb8Image& frame, const Mask& inside) {
  if (frame.width > kEnough) return is_colourless(every_second(frame), every_second(inside));
  constexpr double kNearlyAll = 0.85;
  const GreyPixels found = grey_pixels(frame, inside, smoothing_radius(frame));
  return static_cast<double>(found.grey_count) > kNearlyAll * static_cast<double>(found.lit_count);
}

}  // namespace organbake
