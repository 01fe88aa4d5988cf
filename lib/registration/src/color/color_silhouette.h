// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "color/color_scene.h"
#include "organbake/registration/register_photo.h"
#include "pose/refine.h"

namespace organbake {

// The pose near a start (20 mm and 15° off) at which the organ's silhouette covers what has its
// colours and no more: where brightness tells nothing, or its light is unlike any model. What the
// organ's colours are is learnt with the pose, coarse to fine; something in front, which takes up
// as much of the organ as of its ground, tells nothing. The pose keeps near its start as far as
// colours leave it open, so that an organ partly hidden is not taken for a smaller, farther one.
//
// A silhouette is that of other poses, too (of a mirrored organ, of one turned about a symmetry):
// the verdict is doubtful at best.
RegisteredPhoto register_by_color(const RegisteredSurface& surface, const PhotoToRegister& photo,
                                  const RigidTransform& start, const RunContext& context = {});

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
