// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "appearance/photo_pyramid.h"
#include "appearance/prediction.h"

namespace organbake {

struct OutlineCheck {
  int places = 0;    // pixels of the outline
  int asked = 0;     // places along the outline where photograph and prediction vary at all
  double share = 0;  // of those, the prediction fits best within a pixel of where it is
};
// Shifts the predicted picture across its outline, place by place, up to 10 pixels either way, and
// looks where the photograph agrees best. R can be high for a wrong organ of about the right shape;
// that its outline lies right all round is another matter. `background` is the radiance beyond the
// prediction's window.
OutlineCheck check_outline(const PhotoLevel& level, const Prediction& prediction,
                           double background);

}  // namespace organbake
