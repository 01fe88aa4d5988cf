// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "bundle/lighting.h"

namespace organbake {

// The studio's lights, fixed in the world (LPS) so that every photograph shows the same shading:
// a warm key from the front, right and above, a cool fill from behind on the left, and an ambient
// that is brighter from above; the sheen of moist tissue and the glints of the film on it.
const Lighting& studio_lighting();

}  // namespace organbake
