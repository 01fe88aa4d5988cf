// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/motion/sightings.h"

namespace organbake {

// Finds the pose of a view from the places that it sees: three points at a time by OpenCV's RANSAC
// (Fischler & Bolles 1981), then all that agree. False, and no pose, when fewer than
// `least_agreeing_share` of them, or too few at all, agree. Deterministic.
bool pose_view(double least_agreeing_share, std::size_t view, Scene& scene);

}  // namespace organbake
