// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "organbake/warp/warper.h"

namespace organbake {

// The pictures of several organs from one view as one picture: at every pixel the one that is
// nearest to the eye, the first at ties. All of one size, with depth. What `options` does not ask
// to keep is not kept. Outlines are smoothed against the background and against skin that lies
// deeper_mm behind, which is no longer one surface.
void join_layers(const std::vector<const Frame*>& layers, const DrawOptions& options,
                 float deeper_mm, Frame& frame);

// The sums of what was drawn and skipped, the largest texels; the cameras are the first organ's.
DrawReport joined_report(const std::vector<DrawReport>& reports, bool unchanged);

}  // namespace organbake
