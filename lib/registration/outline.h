// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "registration/photo_pyramid.h"
#include "registration/prediction.h"

namespace organbake {

struct OutlineCheck {
  int asked = 0;     // places along the outline where the photograph has an edge at all
  double share = 0;  // of those, one of about the strongest lies within two pixels
};

// Looks across the predicted outline for the photograph's own edge, up to 12 pixels either way
// (Harris & Stennett 1990). NCC can be high for a wrong organ of the right size: this cannot.
OutlineCheck check_outline(const PhotoLevel& level, const Prediction& prediction);

}  // namespace organbake
