// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

#include "organbake/pipelines/stage.h"
#include "organbake/registration/registered_surface.h"
#include "stages/register/photos.h"

namespace organbake {

bool is_video(const std::filesystem::path& path);

inline constexpr std::size_t kOverlayEach = 25;  // frames: one a second
// CLIP_000000.png and so on, as whoever takes the video apart would name them.
std::string frame_name(const std::filesystem::path& video, std::size_t index);

struct ClipToTrack {
  std::filesystem::path video, intrinsics;
  Rgb8Image mask;                       // of all frames; empty = all counts
  std::optional<RigidTransform> start;  // of the first frame: camera_from_world
};

// What a recorder has laid over the video counts no longer; its share of the frames. The clip's
// motion, which is found before, has said it.
double leave_insets_out(const RunContext& context, ClipToTrack& clip);

// The poses of a video's frames, in their order. Overlays of one frame in 25 go into the folder. A
// video that is damaged ends there: `damage` then says where.
std::vector<NamedPose> track_clip(const RegisteredSurface& surface, const ClipToTrack& clip,
                                  const RegistrationOptions& options,
                                  const std::filesystem::path& overlay_folder,
                                  const RunContext& context, std::string& damage);

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

// Runs the stage `motion` with its defaults on a clip that came without depth, and leaves what it
// makes in `folder`. Returns why the clip tells no motion (the scope stands still, turns or zooms;
// frames that no lens has taken); nothing where it does.
std::string find_motion_of_clip(const ClipToTrack& clip, const std::filesystem::path& folder,
                                const RunContext& context);

}  // namespace organbake
