// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "truth/pixel_truth.h"

namespace organbake {

// Normals of the skin's pixels, from the places of the points that their neighbours show: what
// bends or breaks within a pixel has none of its own. Tools keep theirs.
void put_skin_normals(PixelTruth& truth);

}  // namespace organbake
