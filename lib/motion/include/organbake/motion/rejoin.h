// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "organbake/motion/sightings.h"
#include "organbake/shading/grid.h"

namespace organbake {

// A view's picture as features are tracked in it (tracked_picture()), and where they may lie.
struct TrackedView {
  Grid<std::uint8_t> picture;
  Mask usable;
};

// Looks for places in views that do not see them yet but should, by where they are projected to:
// where the scope comes back, and where a track was lost. Each is tracked there from the view that
// saw it under the most similar direction and distance, and back again. Returns how many sightings
// are new; they agree until drop_outliers() says otherwise. Deterministic for any number of
// threads.
std::size_t rejoin(const std::vector<TrackedView>& views, Scene& scene);

}  // namespace organbake
