// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

#include "organbake/registration/registered_surface.h"
#include "stages/register/pose_document.h"

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

}  // namespace organbake
