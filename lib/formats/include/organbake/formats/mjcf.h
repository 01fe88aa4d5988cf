// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "organbake/bundle/bundle.h"

namespace organbake {

// A bundle's tetrahedra as a model of MuJoCo (MJCF, from version 3): a flex of dimension 3 whose
// nodes are bodies with three slides each and their own mass, those of anchors without slides.
// Metres, kilograms, seconds; the axes of the world: x left, y posterior, z superior. Node i is
// the body "n<i>". MuJoCo has one modulus for all tetrahedra: those that are partly tissue are
// stiffer in it. Its forces are explicit: the time step is as short, and the damping as small, as
// that takes. Throws UsageError for a bundle without tetrahedra.
std::string mjcf_text(const Bundle& bundle);

}  // namespace organbake
