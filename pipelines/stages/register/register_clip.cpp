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
#include "organbake/shading/insets.h"
#include "organbake/shading/video_reader.h"
#include "stages/register/straight_photo.h"
#include "stages/shared/clip_source.h"

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

double leave_insets_out(const RunContext& context, ClipToTrack& clip) {
  const auto video = std::make_shared<VideoReader>(clip.video);
  const Mask insets =
      insets_of([video](StoredPicture& picture) { return video->next(picture); }, context);
  if (insets.size() == 0) return 0;
  if (clip.mask.width == 0) {
    clip.mask = Rgb8Image(insets.width, insets.height);
    std::fill(clip.mask.pixels.begin(), clip.mask.pixels.end(), std::uint8_t{255});
  }
  // A given mask of another size is refused with the first frame.
  const double share = share_of(insets);
  if (clip.mask.width != insets.width || clip.mask.height != insets.height) return share;
  for (std::size_t k = 0; k < insets.size(); ++k)
    if (insets.values[k]) std::fill_n(&clip.mask.pixels[3 * k], 3, std::uint8_t{0});
  return share;
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
