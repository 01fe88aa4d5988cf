// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truth/moment.h"

namespace organbake {

// Whether the skin round a bound point is turned to the eye at a moment, by the small triangle of
// the base layer that it lies over: near an outline this decides to a fraction of a pixel, where
// samples, each with the mean slope of its patch, reach a little over it.
bool faces_eye(const Moment& moment, std::size_t organ, const BoundPixel& point);

}  // namespace organbake
