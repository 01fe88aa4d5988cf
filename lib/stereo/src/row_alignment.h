// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "disparity.h"
#include "organbake/stereo/prepared_eyes.h"

namespace organbake {

// Finds how far the rows of two rectified pictures are apart; zero where that is no more than
// chance, or too little of the pictures tells it. `range`: of the disparities to look at.
RowAlignment find_row_alignment(const Rgb8Image& left, const Rgb8Image& right,
                                const Intrinsics& right_camera, const DisparityRange& range);

// The right picture with that taken out.
Rgb8Image aligned(const Rgb8Image& right, const Intrinsics& right_camera,
                  const RowAlignment& alignment);

}  // namespace organbake
