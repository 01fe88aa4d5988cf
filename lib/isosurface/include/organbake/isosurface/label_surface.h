// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/isosurface/isosurface.h"

namespace organbake {

// A smooth closed surface around one label of a mask, on the mask's own grid: the level of the
// blurred label that encloses the volume of its voxels, to 0.1 %; said when it misses that by more
// than 1 %. `scan`, whose voxels don't count, tells where the organ is cut off; without it that is
// the mask's own border. Throws BadDataError when the label is absent (the labels present are
// named), or so fine for its smoothing that 10 % of its volume would be missed.
Isosurface extract_label_surface(const Volume& mask, const IsosurfaceOptions& options,
                                 const RunContext& context = {}, const Volume* scan = nullptr);

}  // namespace organbake
