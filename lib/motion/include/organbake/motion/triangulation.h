// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/motion/sightings.h"

namespace organbake {

struct TriangulationOptions {
  double least_angle_rad = 0.012;  // between two rays: 0.7 degrees
  double most_error_px = 3;        // of a sighting that agrees
};

// Gives a place to each landmark without one that two posed views see under a wide enough angle,
// and says which of its sightings agree. Places are the point nearest to the rays of the two views
// that stand widest apart, then Gauss–Newton over the pixels of all that agree. With `view`, of
// the landmarks that this view sees.
void triangulate(const TriangulationOptions& options, Scene& scene,
                 std::optional<std::size_t> view = std::nullopt);

// Sightings farther off do not agree (others do again), and landmarks of which fewer than two
// agree, or under too small an angle, lose their place. How many sightings agree afterwards.
std::size_t drop_outliers(const TriangulationOptions& options, Scene& scene);

}  // namespace organbake
