// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "organbake/shading/grid.h"

namespace organbake {

// The plane through the values around each pixel, by least squares over a window weighted like a
// tent: what a smooth surface is, near by. All pixels at once; large windows look at squares of
// pixels.
class LocalPlanes {
 public:
  // weight: how much a pixel's value counts, 0 = not at all.
  LocalPlanes(const Plane& value, const Plane& weight, int radius_px);
  ~LocalPlanes();

  // The weight around a pixel, as a mean over the window.
  float weight(int x, int y) const;
  struct Fit {
    float value = 0;     // of the plane at the pixel
    float variance = 0;  // of the values about the plane
  };
  // Only where the weight is positive.
  Fit at(int x, int y) const;

 private:
  struct Moments;
  std::unique_ptr<const Moments> moments_;
};

}  // namespace organbake
