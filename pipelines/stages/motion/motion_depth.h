// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>
#include <vector>

#include "organbake/shading/frame_depth.h"
#include "stages/motion/motion_clip.h"

namespace organbake {

// A frame of which depth is made.
struct KeyView {
  std::size_t frame = 0;  // of the clip
  PreparedFrame prepared;
  RigidTransform camera_from_world;
  FrameDepth depth;
  double swept_share = 0;  // of the field of view: what parallax is sure of
};

// Depth of key frames, evenly spread over the posed views, in the unit of the scene: each swept
// against those of the other views that see it under the best angles, held against the other key
// frames, and what is left open filled by shading.
std::vector<KeyView> key_depths(const ClipMotion& motion, const ViewPictures& pictures,
                                const MotionStageOptions& options, const RunContext& context);

}  // namespace organbake
