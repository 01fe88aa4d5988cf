// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "moving_scene.h"

namespace organbake {

// Of seed 1, as clips have it by default; made once.
inline const TissueRelief& relief() {
  static const TissueRelief relief(1);
  return relief;
}

}  // namespace organbake
