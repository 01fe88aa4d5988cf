// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/motion/clip_picture.h"
#include "organbake/motion/lens_spread.h"
#include "organbake/motion/reconstruction.h"
#include "organbake/motion/view_choice.h"

namespace organbake {

struct MotionOptions {
  ViewChoice views;
  ReconstructionOptions reconstruction;
  bool rejoin = true;              // look for tissue that comes back into view
  double least_motion_px = 4;      // of features over the clip: less is a scope that stands still
  double least_angle_rad = 0.017;  // between the rays to a place, median: less tells no depth
  std::size_t fewest_views = 5;
};

// Frames of a clip that one rigid scene explains, or does not.
struct FrameSpan {
  std::size_t first = 0, last = 0;
  std::string reason;  // why it is left out
};

// How the scope moved, and what it saw: of the span of the clip that the most views of one rigid
// scene explain. The unit of length is the scene's own.
struct ClipMotion {
  std::string failure;  // why the clip tells no shape; empty when it does
  Scene scene;          // of the views
  std::vector<std::size_t> view_frames;
  // Of each frame of the clip, from those of the views; nothing outside the span.
  std::vector<std::optional<RigidTransform>> camera_from_world;
  LensSpread lens_spread;
  std::vector<FrameSpan> left_out;
  // Agreeing sightings of places that three views or more see under more than 2 degrees.
  double mean_error_px = 0, mean_track = 0, median_angle_rad = 0, parallax_px = 0;
  std::size_t points = 0, rejoined = 0;
};

// `sharpness` is of each frame. `lens` is given, or what the search for it starts from (then
// options.reconstruction.lens says what of it is free). Does not throw for a clip that tells
// nothing. Deterministic.
ClipMotion find_motion(const MotionOptions& options, const ClipTracks& clip,
                       const std::vector<double>& sharpness, const Intrinsics& lens,
                       const PictureLoader& load, const RunContext& context = {});

// The same for poses that another program found: places are found by them, and nothing is moved.
// Views are the posed frames, or some of them where there are more than options.views has.
ClipMotion motion_of_poses(const MotionOptions& options, const ClipTracks& clip,
                           const Intrinsics& lens,
                           std::vector<std::optional<RigidTransform>> camera_from_world);

}  // namespace organbake
