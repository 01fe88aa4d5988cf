// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/motion/clip_motion.h"
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
};

// Depth of key frames in the unit of the scene: each swept against those of the other views that
// see it under the best angles, held against the other key frames, and what is left open filled by
// shading. Throws BadDataError where fewer than two frames see enough of the tissue.
std::vector<KeyDepth> key_depths(const KeyDepthOptions& options, const ClipMotion& motion,
                                 const PictureLoader& load, const RunContext& context = {});

// How many millimetres the unit of a scene is, and how sure that is.
struct KnownScale {
  double mm_per_unit = 0;
  double relative_sd = 0;
  std::size_t frames = 0;  // key frames that tell it
};

// Two places of the tissue as one frame of the clip shows them (pixels of its full size), and how
// far they are apart.
struct KnownDistance {
  std::size_t frame = 0;
  Eigen::Vector2d first, second;
  double distance_mm = 0;
};
// Reads "FRAME,X1,Y1,X2,Y2,MM". Throws UsageError that says what is wrong with it.
KnownDistance parse_known_distance(const std::string& text);

// The median over the key frames that have depth at both places; its standard deviation is of their
// differences and of pointing to a pixel. Throws UsageError where the frame has no pose or lacks
// the pixels, BadDataError where no key frame has depth at both.
KnownScale scale_by_distance(const KnownDistance& known, const ClipMotion& motion,
                             const std::vector<KeyDepth>& keys);

// From instruments that come into the key frames: the two outlines of a straight shaft are planes
// through the lens, and their angle puts a shaft of this diameter at its distance. Its tip is taken
// to touch the tissue in the frames where it comes nearest to it, of which the standard deviation
// knows nothing: where it never does, all is larger. Throws BadDataError where no key frame shows a
// shaft.
KnownScale scale_by_shaft(double diameter_mm, const std::vector<KeyDepth>& keys);

}  // namespace organbake
