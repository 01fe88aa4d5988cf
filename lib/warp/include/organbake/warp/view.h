// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/geometry/camera.h"

namespace organbake {

inline constexpr int kLargestSide_px = 16384;  // of a picture that can be drawn

// Whoever looks: a pinhole without distortion, of any size, and the plane in front of which nothing
// is drawn (mm along the view).
struct View {
  PosedCamera camera;
  double near_mm = 1;

  // Throws UsageError for distortion, a side beyond 16,384 pixels, or numbers that are not finite.
  void check() const;
};

bool operator==(const View& a, const View& b);

}  // namespace organbake
