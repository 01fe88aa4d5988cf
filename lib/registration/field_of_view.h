// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <vector>

#include "image/channel_image.h"

namespace organbake {

// 1 inside the round field of view of an endoscope, 0 in its black border; all 1 when the picture
// has no such border. The field is found as a circle: seen from the picture's centre, the outermost
// pixels that are not black lie on one, cut by the picture's edges at most. A dark background
// round an organ is no border: its outline is no circle, or far too small a one.
std::vector<std::uint8_t> inside_round_field(const Rgb8Image& photo);

}  // namespace organbake
