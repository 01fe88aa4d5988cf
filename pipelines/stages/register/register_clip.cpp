// SPDX-License-Identifier: GPL-3.0-or-later
#include "stages/register/register_clip.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/image/png.h"
#include "organbake/registration/overlay.h"
#include "organbake/registration/track.h"
#include "organbake/shading/video_reader.h"
#include "stages/register/straight_photo.h"

namespace organbake {

namespace fs = std::filesystem;

std::string frame_name(const fs::path& video, std::size_t index) {
  std::array<char, 16> number{};
  std::snprintf(number.data(), number.size(), "_%06zu.png", index);
  return video.stem().string() + number.data();
}

bool is_video(const fs::path& path) {
  constexpr std::array kVideos = {".mp4", ".m4v", ".mkv", ".avi", ".mov", ".webm", ".mpg", ".mpeg"};
  return std::find(kVideos.begin(), kVideos.end(), lower_ending(path)) != kVideos.end();
}

std::vector<NamedPose> track_clip(const RegisteredSurface& surface, const ClipToTrack& clip,
                                  const RegistrationOptions& options,
                                  const fs::path& overlay_folder, const RunContext& context,
                                  std::string& damage) {
  VideoReader video(clip.video);
  std::unique_ptr<PoseTracker> tracker;
  std::vector<NamedPose> poses;
  Intrinsics lens;
  try {
    for (StoredPicture stored; video.next(stored);) {
      context.throw_if_cancelled();
      const Rgb8Image& frame = stored.color;  // as the intrinsics were measured in
      const std::string name = frame_name(clip.video, poses.size());
      if (!tracker) {
        lens = lens_of_photo(clip.intrinsics, name, frame, context);
        tracker = std::make_unique<PoseTracker>(
            surface, straight_photo({{}, {}, lens, {}, {}, {}}).intrinsics, options);
        if (clip.start) tracker->start_from(*clip.start);
      }
      const PhotoToRegister photo = straight_photo({frame, clip.mask, lens, {}, {}, {}});
      RegisteredPhoto registered = tracker->next(photo.image, photo.mask, context);
      if (poses.size() % kOverlayEach == 0) {
        context.info("frame " + std::to_string(poses.size()) + ": " +
                     name_of(registered.quality.verdict));
        write_png(overlay_folder / ("overlay_" + fs::path(name).stem().string() + ".png"),
                  draw_overlay(surface, photo.image, registered, options), 1);
      }
      registered.camera = camera_as_taken(registered, lens);
      poses.push_back({name, std::move(registered)});
    }
  } catch (const BadDataError& error) {
    if (poses.empty()) throw;
    damage = error.what();
  }
  return poses;
}

}  // namespace organbake
