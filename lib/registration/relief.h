// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "registration/photo_pyramid.h"
#include "registration/prediction.h"

namespace organbake {

struct ReliefCheck {
  int asked = 0;     // squares of skin whose predicted shading says where they are, both ways
  double share = 0;  // of those, the photograph agrees best within two pixels of where it is
};

// What check_outline is for outlines, for what lies inside: the predicted picture of a small square
// is shifted over the photograph, up to 8 pixels each way. Texture misleads some squares, a wrong
// pose nearly all: by chance one in twenty agrees.
ReliefCheck check_relief(const PhotoLevel& level, const Prediction& prediction);

}  // namespace organbake
