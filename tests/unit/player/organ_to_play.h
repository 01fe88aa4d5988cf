// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/bundle/bundle.h"
#include "organbake/player/script.h"
#include "support/synthetic_bundle.h"

namespace organbake {

// The synthetic organ with 6 cameras of 128² and an 80-face proxy, read once.
const SyntheticOptions& organ_options();
const Bundle& organ_to_play();

// A short script: the eye goes round while a probe presses where the organ faces camera 0.
Script short_script(double depth_mm);

}  // namespace organbake
