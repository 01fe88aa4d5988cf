// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "masks/shaft_search.h"

namespace organbake {

// The outline of a shaft as the hue shows it, a polygon in pixels of the reduced picture: both
// borders may leave their straight lines, as they do beside a tapered tip. Empty where nothing is
// left of the shaft.
std::vector<cv::Point2d> trace_outline(const ShaftView& view, const Shaft& shaft);

}  // namespace organbake
