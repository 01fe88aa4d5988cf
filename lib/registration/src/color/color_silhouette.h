// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "color/color_scene.h"
#include "organbake/registration/register_photo.h"
#include "pose/pose_refinement.h"

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

}  // namespace organbake
