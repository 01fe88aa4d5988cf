// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "image/channel_image.h"
#include "shading/grid.h"

namespace organbake {

// The part of a frame that the endoscope's stop lets through: what is joined to the largest region
// that is not black, its holes closed (blood and shadows are tissue), shrunk by `margin_px`.
// Letters and logos on the black border are other regions and fall away. A frame without a black
// border is all inside. A black frame gives an empty mask.
Mask field_of_view(const Rgb8Image& frame, int margin_px);

}  // namespace organbake
