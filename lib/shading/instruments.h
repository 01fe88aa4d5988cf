// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "image/channel_image.h"
#include "shading/grid.h"

namespace organbake {

// Metal and plastic: grey or bluish where tissue is red or yellow, in regions that reach the rim of
// what is inside, since instruments come in from there. Slivers are left out. Non-zero =
// instrument.
Mask find_instruments(const Rgb8Image& frame, const Mask& inside);

// Whether nearly all that is lit is as grey as metal: a grey frame, or one of a camera that is far
// off balance. Colour then tells nothing.
bool is_colourless(const Rgb8Image& frame, const Mask& inside);

}  // namespace organbake
