// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "registration/refine.h"
#include "registration/register_photo.h"

namespace organbake {

// What is refined where an organ is told from its ground by colour: levels whose luminance is how
// likely a pixel shows the organ (0.1…0.9), as its present pose says.
struct ColorSilhouette {
  std::vector<PhotoLevel> pyramid;
  RefineState state;
};

// Colours inside and outside of where the organ is taken to be say how likely each pixel shows it;
// the pose at which it covers what is likely says better what lies inside; and so on, coarse to
// fine. Shading, and so what lights the organ, plays no part. `options.light` must be flat.
ColorSilhouette refine_silhouette(const RegisteredSurface& surface, const PhotoToRegister& photo,
                                  const RigidTransform& start, int finest_side_px,
                                  const RefineOptions& options, const RunContext& context);

}  // namespace organbake
