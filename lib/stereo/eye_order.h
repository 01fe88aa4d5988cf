// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "stereo/disparity.h"

namespace organbake {

// Whether the pictures of two eyes match far better when they change places than as they are. Looks
// only when they match badly as they are (`matched_share` of the tissue).
bool swapped(const EyeImage& left, const EyeImage& right, const DisparityRange& range,
             double matched_share);

}  // namespace organbake
