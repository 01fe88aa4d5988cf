// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/pipelines/stage_module.h"
#include "stages/phantom/options.h"

namespace organbake {

// A scope along a path: frames/, or clip.mp4 where a bit rate is asked for; cameras.json, a camera
// a frame; truth/: what every fifth frame shows, the surface whole and at rest, and frames.csv, the
// breath and the blur of each frame.
StageReport run_moving_clip(const PhantomStageOptions& options, const StageCall& call);

}  // namespace organbake
