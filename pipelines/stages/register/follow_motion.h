// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

#include "organbake/pipelines/stage.h"
#include "stages/register/register_clip.h"

namespace organbake {

// The poses of a video's frames whose motion the stage `motion` found: `motion` is its folder. The
// scene is rigid, so that one pose of the surface in it serves all: it is told by photograph and
// depth of the surest of three key frames. How far the poses that the others tell by themselves lie
// from it (drift) and how unsteady the motion is from frame to frame (jitter) come into the report.
// Throws BadDataError for a folder that is not of this video.
std::vector<NamedPose> follow_motion(const RegisteredSurface& surface, const ClipToTrack& clip,
                                     const std::filesystem::path& motion,
                                     const RegistrationOptions& options,
                                     const std::filesystem::path& overlay_folder,
                                     const RunContext& context, StageReport& report);

// The first frame of which a motion's folder has a pose. Throws as above.
std::size_t first_frame_of_motion(const std::filesystem::path& motion);

}  // namespace organbake
