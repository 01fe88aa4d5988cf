// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/motion/clip_motion.h"
#include "organbake/motion/clip_picture.h"
#include "organbake/shading/frame_depth.h"

namespace organbake {

struct KeyDepthOptions {
  int key_frames = 12;  // at most, evenly spread over the posed views
  int halvings = 1;     // of the frames, before depth is sought for
  bool shading = true;  // fills what parallax leaves open; else there is no depth there
  Mask insets = {};     // of the frames' size, where there are any (InsetFinder)
};

// A frame of which depth is made.
struct KeyDepth {
  std::size_t frame = 0;  // of the clip
  PreparedFrame prepared;
  RigidTransform camera_from_world;
  FrameDepth depth;
  // Of the field of view: what parallax is sure of, and what has depth.
  double swept_share = 0, covered_share = 0;
};

// Depth of key frames in the unit of the scene: each swept against those of the other views that
// see it under the best angles, held against the other key frames, and what is left open filled by
// shading. Throws BadDataError where fewer than two frames see enough of the tissue.
std::vector<KeyDepth> key_depths(const KeyDepthOptions& options, const ClipMotion& motion,
                                 const PictureLoader& load, const RunContext& context = {});

}  // namespace organbake
