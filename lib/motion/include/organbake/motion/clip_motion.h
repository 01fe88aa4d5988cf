// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "organbake/bundle/breath.h"
#include "organbake/core/run_context.h"
#include "organbake/image/picture.h"
#include "organbake/motion/feature_tracker.h"
#include "organbake/motion/scene.h"
#include "organbake/shading/frame_depth.h"
#include "organbake/shading/grid.h"

namespace organbake {

// A frame of a clip, and where tissue is to be seen in it (UsablePixels; of the frame's size).
struct ClipPicture {
  StoredPicture picture;
  Mask usable;
};

// The pictures of these frames of the clip, in their order. They stay where they are.
using PictureLoader =
    std::function<std::vector<const ClipPicture*>(const std::vector<std::size_t>& frames)>;

struct ViewChoice {
  double motion_share = 0.012;  // of the picture's width, from one view to the next
  std::size_t most_apart = 10;  // frames
  std::size_t most_views = 80;
};

// The view after `last`, once the frames up to (not including) `end` settle which it is; nothing
// before. `over`: the shot ends there, and its last frame is a view.
std::optional<std::size_t> next_view(const ViewChoice& choice, const ClipTracks& clip,
                                     const std::vector<double>& sharpness, std::size_t last,
                                     std::size_t end, bool over);

// The frames of a shot (`first` up to, not including, `end`) that are solved for: one whenever the
// scope has moved far enough, of those near it the sharpest. A fast or long shot is taken in longer
// steps, so that there are never more than `most_views`. `sharpness` is of each frame of the clip.
std::vector<std::size_t> choose_views(const ViewChoice& choice, const ClipTracks& clip,
                                      const std::vector<double>& sharpness, std::size_t first,
                                      std::size_t end);

// Poses, places and lens of a clip's views, one after another (Schönberger & Frahm 2016): a first
// pair by its essential matrix, then of two dozen key views each next one from the places that it
// sees, new places from the views that are posed, and bundle adjustment as the scene grows; last,
// all views between, which the places hold. Views that no rigid scene explains stay without a pose.
// The scene comes with its landmarks' sightings and a lens to start from; where views are posed, it
// grows from those. Returns why there is none; nothing when there is one. Deterministic.
std::string reconstruct(const FreeLens& lens, Scene& scene, const RunContext& context = {});

// How sure a lens is that a clip told of itself: standard deviations; 0 of what was given.
struct LensSpread {
  double focal_px = 0, k1 = 0;
};

struct MotionOptions {
  ViewChoice views;
  FreeLens lens;  // what of it is to be found; none = it is given
};

// Frames of a clip that one rigid scene explains, or does not.
struct FrameSpan {
  std::size_t first = 0, last = 0;
  std::string reason;  // why it is left out
};

// Whether a clip supports the scene that was found in it.
struct MotionQuality {
  DepthVerdict verdict = DepthVerdict::failed;
  std::string reason;  // empty when ok
  // What the next best scene (another lens, or inside out) costs by the one that was taken; 0 = no
  // other was found.
  double runner_up = 0;
  // Of the brightness of places with their range from the lamp, both as logarithms: below 0 when
  // what is near is bright, a slope of -2 by the inverse square. 0 = there is nothing to tell by.
  double lamp_correlation = 0, lamp_slope = 0;
  double posed_share = 0;  // of the frames
};

// How the scope moved, and what it saw: of the span of the clip that the most views of one rigid
// scene explain. The unit of length is the scene's own.
struct ClipMotion {
  std::string failure;  // why the clip tells no shape; empty when it does
  MotionQuality quality;
  Scene scene;  // of the views
  std::vector<std::size_t> view_frames;
  // Of each frame of the clip, from those of the views; nothing outside the span.
  std::vector<std::optional<RigidTransform>> camera_from_world;
  LensSpread lens_spread;
  double breath_period_frames = 0;  // by which tissue comes and goes; 0 = none is told
  std::optional<Breath> breath;     // where that could be told from the scope's way
  std::vector<FrameSpan> left_out;
  // Agreeing sightings of places that three views or more see under more than 2 degrees.
  double mean_error_px = 0, median_angle_rad = 0;
  std::size_t points = 0;
};

// `sharpness` is of each frame. `lens` is given, or what the search for it starts from (then
// options.lens says what of it is free). Does not throw for a clip that tells
// nothing. Deterministic.
ClipMotion find_motion(const MotionOptions& options, const ClipTracks& clip,
                       const std::vector<double>& sharpness, const Intrinsics& lens,
                       const PictureLoader& load, const RunContext& context = {});

// The same for poses that another program found: places are found by them, and nothing is moved.
// Views are the posed frames, or some of them where there are more than options.views has.
ClipMotion motion_of_poses(const MotionOptions& options, const ClipTracks& clip,
                           const Intrinsics& lens,
                           std::vector<std::optional<RigidTransform>> camera_from_world,
                           const PictureLoader& load);

}  // namespace organbake
