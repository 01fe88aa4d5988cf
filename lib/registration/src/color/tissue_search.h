// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "appearance/photo_pyramid.h"
#include "organbake/core/run_context.h"
#include "organbake/image/channel_image.h"
#include "organbake/registration/object_pose.h"
#include "organbake/registration/registered_surface.h"

namespace organbake {

// Of the pyramid of a photograph of living tissue: the level that starts are tried on has between
// half as many and so many pixels on its longer side.
inline constexpr int kCoarsestTissueSide = 119;

// The pose of an open surface in a photograph of living tissue, near a start that is up to about
// 15 mm and 10° off: fits from places all round the start on the coarsest level, of which the
// likeliest are followed to finer ones. Nothing when the surface is out of the picture. Threads
// across starts; ordered and seeded, so repeatable.
std::optional<ObjectPose> search_tissue(const RegisteredSurface& surface, const Rgb8Image& photo,
                                        const std::vector<PhotoLevel>& pyramid,
                                        const ObjectPose& start, const RunContext& context);

}  // namespace organbake
