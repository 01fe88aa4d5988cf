// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "organbake/geometry/camera.h"
#include "organbake/geometry/view_manifold.h"

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

// Shares below this are dropped and the others drawn up to it, continuously: a camera that hardly
// counts is not worth its samples. Measured at ten views: up to 0.15 costs no view 0.01 dB; at 0.2
// one loses 0.8 dB, since the third camera alone sees a part of it.
inline constexpr double kLeastShare = 0.15;
ViewWeights trimmed(ViewWeights weights);

// What each camera counts in a view: the manifold's weights, trimmed.
ViewWeights drawn_shares(const ViewManifold& manifold, const View& view);
// The cameras that have a share in a view.
std::vector<std::size_t> used_cameras(const ViewWeights& weights);

}  // namespace organbake
