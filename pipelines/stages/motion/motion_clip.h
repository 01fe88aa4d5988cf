// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <string>
#include <vector>

#include "organbake/image/picture.h"
#include "organbake/motion/clip_motion.h"
#include "organbake/pipelines/stage.h"
#include "stages/motion/options.h"

namespace organbake {

// A clip that was followed from its first frame to its last.
struct FollowedClip {
  ClipTracks tracks;
  std::vector<double> sharpness;   // of each frame
  std::vector<std::string> names;  // likewise
  std::optional<Intrinsics> lens;  // nothing = none is given
  double instrument_share = 0;
  std::string damage;  // what ended it early
};

// Reads the frames one after another; a few are in memory at once. Throws NoInputError,
// BadDataError.
FollowedClip follow_clip(const StageCall& call, const MotionStageOptions& options);

// Frames of the clip by their number, read again: what was asked for once is kept.
class ViewPictures {
 public:
  ViewPictures(const StageCall& call) : call_(call) {}
  // Reads what is not there yet, in one go through the clip.
  void read(const std::vector<std::size_t>& frames);
  const StoredPicture& picture(std::size_t frame) const { return pictures_.at(frame); }
  std::vector<TrackedView> tracked(const std::vector<std::size_t>& frames);

 private:
  const StageCall& call_;
  std::map<std::size_t, StoredPicture> pictures_;
  std::map<std::size_t, Mask> usable_;
};

}  // namespace organbake
