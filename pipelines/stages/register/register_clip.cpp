// SPDX-License-Identifier: GPL-3.0-or-later
// The poses of a video's frames: each tracked from the last, or all carried by a motion that
// another stage found, in which one pose serves all.
#include "stages/register/registering.h"

#include <algorithm>
#include <array>
#include <map>
#include <memory>

#include "organbake/core/error.h"
#include "organbake/core/files.h"
#include "organbake/core/text.h"
#include "organbake/image/png.h"
#include "organbake/shading/frame_source.h"
#include "organbake/shading/masks.h"
#include "stages/shared/clip_source.h"

namespace organbake {
namespace fs = std::filesystem;

namespace {

// CLIP_000000.png and so on, as whoever takes the video apart would name them.
std::string frame_name(const fs::path& video, std::size_t index) {
  constexpr std::size_t kDigits = 6;
  return video.stem().string() + "_" + padded(index, kDigits) + ".png";
}

}  // namespace

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
                  draw_overlay(surface, photo.image, registered), 1);
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

namespace {

namespace fs = std::filesystem;

// Frames are named by their number in the clip.
std::optional<std::size_t> frame_number(const std::string& name) {
  if (name.empty() || name.size() > 9 ||
      !std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; }))
    return std::nullopt;
  return std::stoul(name);
}

ScopeMotion read_motion(const fs::path& folder) {
  ScopeMotion motions;
  for (const PosedCamera& camera : read_cameras(folder / "cameras.json").cameras)
    if (const auto frame = frame_number(camera.name)) motions[*frame] = camera.camera_from_world;
  if (motions.empty())
    throw BadDataError(folder / "cameras.json",
                       "names no camera by its frame's number, as motion does of a video");
  return motions;
}

struct KeyMap {
  std::size_t frame = 0;
  DepthFile file;
};

// The first, the middle and the last one.
std::vector<KeyMap> keys_of(const fs::path& folder, const ScopeMotion& motions) {
  std::vector<KeyMap> keys;
  for (const DepthFile& file : depth_files_in(folder))
    if (const auto frame = frame_number(file.depth.stem().string());
        frame && motions.contains(*frame))
      keys.push_back({*frame, file});
  if (keys.empty())
    throw BadDataError(folder, "holds no depth map of a frame that its cameras.json has");
  std::vector<KeyMap> chosen;
  for (const std::size_t at : {std::size_t{0}, keys.size() / 2, keys.size() - 1})
    if (chosen.empty() || chosen.back().frame != keys[at].frame) chosen.push_back(keys[at]);
  return chosen;
}

class FollowedVideo {
 public:
  FollowedVideo(const RegisteredSurface& surface, const ClipToTrack& clip,
                const RegistrationOptions& options, const RunContext& context)
      : surface_(surface), clip_(clip), options_(options), context_(context) {}

  // Calls take(frame, picture) for each frame in turn, up to where the video is damaged.
  template <class Take>
  void each_frame(const Take& take) {
    VideoReader video(clip_.video);
    StoredPicture stored;
    for (std::size_t frame = 0; next_of(video, frame, stored); ++frame) {
      context_.throw_if_cancelled();
      if (frame == 0)
        lens_ = lens_of_photo(clip_.intrinsics, frame_name(clip_.video, 0), stored.color, context_);
      take(frame, stored.color);
    }
  }

  const std::string& damage() const { return damage_; }

  ScenePose register_key(const KeyMap& key, const Rgb8Image& picture,
                         const std::optional<RigidTransform>& start) const {
    PhotoToRegister photo = straight_photo({picture, clip_.mask, lens_, start, {}, {}});
    const DepthPoints points = read_depth_points(key.file, lens_, context_);
    photo.depth = thin_depth(points.places, points.trust, points.relative);
    ScenePose pose{key.frame, register_photo(surface_, photo, options_, context_)};
    if (pose.registered.quality.depth) pose.scale = pose.registered.quality.depth->scale;
    return pose;
  }

  void draw(const Rgb8Image& picture, const RegisteredPhoto& registered,
            const fs::path& file) const {
    const PhotoToRegister photo = straight_photo({picture, {}, lens_, {}, {}, {}});
    RegisteredPhoto straight = registered;
    straight.camera.intrinsics = photo.intrinsics;
    write_png(file, draw_overlay(surface_, photo.image, straight), 1);
  }

  RegisteredPhoto at_frame(const ScenePose& pose, const ScopeMotion& motions,
                           std::size_t frame) const {
    RegisteredPhoto registered = pose.registered;
    registered.camera.camera_from_world = pose.at(motions, frame);
    registered.camera = camera_as_taken(registered, lens_);
    return registered;
  }

 private:
  bool next_of(VideoReader& video, std::size_t frame, StoredPicture& stored) {
    try {
      return video.next(stored);
    } catch (const BadDataError& error) {
      if (frame == 0) throw;
      damage_ = error.what();
      return false;
    }
  }

  const RegisteredSurface& surface_;
  const ClipToTrack& clip_;
  const RegistrationOptions& options_;
  const RunContext& context_;
  Intrinsics lens_;
  std::string damage_;
};

// First the key frame that a start is nearest to, as long as nobody knows how many mm the scene's
// unit has; without one the middle, from which the others are near.
std::vector<ScenePose> register_keys(FollowedVideo& video, const std::vector<KeyMap>& keys,
                                     const ScopeMotion& motions, const ClipToTrack& clip) {
  std::map<std::size_t, Rgb8Image> pictures;
  video.each_frame([&](std::size_t frame, const Rgb8Image& picture) {
    if (std::any_of(keys.begin(), keys.end(),
                    [&](const KeyMap& key) { return key.frame == frame; }))
      pictures[frame] = picture;
  });
  std::vector<ScenePose> poses;
  const auto add = [&](const KeyMap& key, const std::optional<RigidTransform>& from) {
    const auto picture = pictures.find(key.frame);
    if (picture == pictures.end())
      throw BadDataError(clip.video, "has no frame " + std::to_string(key.frame) +
                                         ", of which the motion's folder has a depth map");
    poses.push_back(video.register_key(key, picture->second, from));
  };
  const KeyMap& nearest = clip.start ? keys.front() : keys[keys.size() / 2];
  std::optional<RigidTransform> start = clip.start;
  const RigidTransform& first = motions.begin()->second;
  if (start) start = motions.at(nearest.frame) * first.inverse() * *start;
  add(nearest, start);
  for (const KeyMap& key : keys)
    if (key.frame != nearest.frame) add(key, poses.front().at(motions, key.frame));
  return poses;
}

}  // namespace

std::size_t first_frame_of_motion(const fs::path& motion) {
  return read_motion(motion).begin()->first;
}

std::vector<NamedPose> follow_motion(const RegisteredSurface& surface, const ClipToTrack& clip,
                                     const fs::path& motion, const RegistrationOptions& options,
                                     const fs::path& overlay_folder, const RunContext& context,
                                     StageReport& report) {
  const ScopeMotion motions = read_motion(motion);
  if (const std::size_t first = motions.begin()->first; clip.start && first > 0)
    context.warn("the start is taken for that of frame " + std::to_string(first) +
                 ", the first one that the motion has a pose of");
  FollowedVideo video(surface, clip, options, context);
  const std::vector<ScenePose> keys = register_keys(video, keys_of(motion, motions), motions, clip);
  const SettledPose settled = settled_pose(surface, keys, motions);
  const ScenePose& surest = settled.pose;
  std::vector<NamedPose> poses;
  std::size_t unposed = 0;
  video.each_frame([&](std::size_t frame, const Rgb8Image& picture) {
    if (!motions.contains(frame)) {
      ++unposed;
      return;
    }
    const std::string name = frame_name(clip.video, frame);
    if (poses.size() % kOverlayEach == 0) {
      RegisteredPhoto drawn = surest.registered;
      drawn.camera.camera_from_world = surest.at(motions, frame);
      video.draw(picture, drawn,
                 overlay_folder / ("overlay_" + fs::path(name).stem().string() + ".png"));
    }
    poses.push_back({name, video.at_frame(surest, motions, frame)});
  });
  report.bad_data = video.damage();
  report.add("scene_frame", surest.frame);
  report.add("drift_mm", settled.drift_mm);
  report.add("jitter_mm", settled.jitter_mm);
  if (unposed > 0)
    report.skipped.push_back(
        {std::to_string(unposed) + " frames of the video", "the motion has no pose of them"});
  return poses;
}

std::string find_motion_of_clip(const ClipToTrack& clip, const std::filesystem::path& folder,
                                const RunContext& context) {
  const Stage* motion = find_stage("motion");
  const StageOptions options = motion->make_options();
  make_folder(folder);
  const StageCall call{options.storage.get(),
                       {},
                       {{"frames", clip.video}, {"intrinsics", clip.intrinsics}},
                       folder,
                       context};
  try {
    return run_in_module(*motion, call).declined;
  } catch (const BadDataError& error) {
    return error.what();  // a video that nobody can read is told when its frames are read
  }
}

}  // namespace organbake
