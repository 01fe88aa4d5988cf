// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/geometry/camera.h"

namespace organbake {

inline constexpr int kLargestSide_px = 16384;  // of a picture that can be drawn

// A lens comes no nearer to what it shows: skin that lies nearer is not drawn.
inline constexpr double kNearest_mm = 0.25;

// Whoever looks: a pinhole without distortion, of any size, and the plane in front of which nothing
// is drawn (mm along the view).
struct View {
  PosedCamera camera;
  double near_mm = kNearest_mm;

  // Throws UsageError for distortion, a side beyond 16,384 pixels, or numbers that are not finite.
  void check() const;
};

bool operator==(const View& a, const View& b);

}  // namespace organbake
