// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "registration/color_scene.h"
#include "registration/refine.h"

namespace organbake {

struct SilhouetteFit {
  ObjectPose pose;
  std::vector<float> likely;  // likely_organ at the pose
  bool usable = false;        // the organ is in the picture and not far from its start
};

// How much a pixel's colour tells: 0 for a likelihood of 0.5, 1 where it is certain.
inline float telling(float likely) { return (2 * likely - 1) * (2 * likely - 1); }

SilhouetteFit fit_silhouette(const RegisteredSurface& surface, const ColorScene& scene,
                             const ObjectPose& start, const RunContext& context);

// Of the fit's residuals, for its covariance.
Curvature silhouette_curvature(const RegisteredSurface& surface, const ColorScene& scene,
                               const SilhouetteFit& fit);

}  // namespace organbake
