// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "organbake/motion/clip_picture.h"
#include "organbake/motion/sightings.h"

namespace organbake {

// Looks for places in views that do not see them yet but should, by where they are projected to:
// where the scope comes back, and where a track was lost. Each is tracked there from the view that
// saw it under the most similar direction and distance, and back again. Returns how many sightings
// are new; they agree until drop_outliers() says otherwise. Deterministic for any number of
// threads.
std::size_t rejoin(const std::vector<const ClipPicture*>& views, Scene& scene);

}  // namespace organbake
