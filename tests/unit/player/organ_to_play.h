// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/player/script.h"
#include "support/synthetic_bundle.h"

namespace organbake {

// A short script for organ_to_play(): the eye goes round while a probe presses where the organ
// faces camera 0.
Script short_script(double depth_mm);

}  // namespace organbake
