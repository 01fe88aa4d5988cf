// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "organbake/motion/clip_motion.h"
#include "organbake/motion/feature_tracker.h"
#include "organbake/pipelines/stage.h"
#include "stages/motion/options.h"

namespace organbake {

// Frames of the clip by their numbers: those kept from the first reading, the others read again.
class ClipPictures {
 public:
  explicit ClipPictures(const StageCall& call) : call_(call) {}
  // Forgets all; from now on tissue is looked for beside these insets alone.
  void begin_beside(Mask insets);
  void keep(std::size_t frame, ClipPicture picture) { kept_[frame] = std::move(picture); }
  // Forgets the frames from `first` up to (not including) `end`.
  void drop(std::size_t first, std::size_t end);
  // Reads what is not there yet, in one go through the clip. Throws BadDataError for a frame that
  // the clip no longer has.
  std::vector<const ClipPicture*> load(const std::vector<std::size_t>& frames);
  const Rgb8Image& color(std::size_t frame) const { return kept_.at(frame).picture.color; }

 private:
  const StageCall& call_;
  Mask insets_;
  std::map<std::size_t, ClipPicture> kept_;
};

// A clip that was followed from its first frame to its last.
struct FollowedClip {
  ClipTracks tracks;
  std::vector<double> sharpness;               // of each frame
  std::vector<double> brightness;              // likewise: the mean of its green levels
  std::vector<std::string> names;              // likewise
  std::optional<Intrinsics> lens;              // nothing = none is given
  std::optional<Eigen::Vector2d> stop_center;  // UsablePixels
  Mask insets;                                 // of the frames' size, where there are any
  std::string damage;                          // what ended it early
};

// Reads the frames one after another, and keeps those in `pictures` that choose_views() will take:
// as many as it takes of one shot; a clip of more is read again. So is one with insets, which are
// known at its end, to be followed without them. Throws NoInputError, BadDataError.
FollowedClip follow_clip(const StageCall& call, ClipPictures& pictures);

// cameras.json of all posed frames, colmap/ with the points and where they are seen, points.ply,
// breath_field.json where the tissue breathes.
void write_scene(const std::filesystem::path& folder, const FollowedClip& clip,
                 const ClipMotion& motion, const ClipPictures& pictures);
// motion.png: the points over a key frame, near ones warm, and the scope's way.
void write_overlay(const std::filesystem::path& folder, const ClipMotion& motion,
                   const ClipPictures& pictures, std::size_t frame);

}  // namespace organbake
