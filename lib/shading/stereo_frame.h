// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "image/channel_image.h"

namespace organbake {

enum class StereoLayout { none, side_by_side, top_bottom };

// Whether a frame holds two pictures of one scene: its halves, without their slow shading, are
// alike but for a shift (normalised correlation at low resolution).
StereoLayout find_stereo_layout(const Rgb8Image& frame);

}  // namespace organbake
