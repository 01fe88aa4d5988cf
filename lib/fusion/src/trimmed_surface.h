// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/fusion/distance_volume.h"

namespace organbake {

// An open surface without its fringe: what lies at a border and is seen with less than
// `least_support` of the usual weight goes, as far inwards as that reaches, and what is left of the
// border is rounded along itself. Holes inside are not made, nor closed.
TriangleMesh trimmed_surface(TriangleMesh mesh, const DistanceVolume& volume, double least_support);

}  // namespace organbake
