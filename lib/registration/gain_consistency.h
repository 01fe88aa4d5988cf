// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "registration/cost_functions/ncc_cost.h"

namespace organbake {

// Whether one gain and offset over all pixels leave as little of the photograph unexplained as one
// of each for every square of `side` pixels, within what noise does. Then nothing varies slowly –
// no vignette, no albedo, no instrument – and the whole picture's R, which gives less away, is the
// efficient estimate.
bool one_gain_fits_all(const LivePrediction& live, const std::vector<WeightedPixel>& pixels,
                       int side);

}  // namespace organbake
