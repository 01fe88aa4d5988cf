// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "image/channel_image.h"
#include "shading/grid.h"

namespace organbake {

// Metal and plastic: grey or bluish where tissue is red or yellow. Regions smaller than a five-
// hundredth of the frame are left (fat, film, highlights). Non-zero = instrument.
Mask find_instruments(const Rgb8Image& frame, const Mask& inside);

}  // namespace organbake
