// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "light/linear_color.h"
#include "organbake/shading/prepared_frame.h"

namespace organbake {

// Where a frame's own colour stands for tissue: neither on highlights nor on their rims, whose blue
// is the lens's, nor where a channel is clipped. Without any such pixel: the diffuse tissue.
Mask clear_tissue(const PreparedFrame& frame);

// Takes highlights and their glow out of a frame's colours, whose light may have been divided out
// already. Luminance and chromaticity are filled apart (push–pull over what is clear): a mixture of
// colours of unlike brightness would be of neither's hue.
void take_highlights_out(const PreparedFrame& frame, const Mask& clear, LinearColor& color);

}  // namespace organbake
