// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

// One feature of the tissue, where it is in frame after frame until it was lost. Pixels as
// Intrinsics have them: the first pixel's centre is (0.5, 0.5).
struct FeatureTrack {
  std::size_t first_frame = 0;
  std::vector<Eigen::Vector2f> pixels;  // one for each frame from there on

  std::size_t end_frame() const { return first_frame + pixels.size(); }
  bool is_in(std::size_t frame) const { return frame >= first_frame && frame < end_frame(); }
  const Eigen::Vector2f& at(std::size_t frame) const { return pixels[frame - first_frame]; }
};

// All features of a clip. Frames are counted as they were given to the tracker.
struct ClipTracks {
  int width = 0, height = 0;
  std::size_t frames = 0;
  std::vector<FeatureTrack> tracks;
  std::vector<std::size_t> shots;  // the first frame of each shot: 0, and where a cut was seen
};

// Median length (pixels) of the way that features of both frames went from one to the other, and
// how many those are.
struct TrackedMotion {
  double median_px = 0;
  std::size_t features = 0;
};
TrackedMotion motion_between(const ClipTracks& clip, std::size_t from, std::size_t to);

// What features are tracked in: the frame's green channel, its contrast evened out (CLAHE). Green
// has the contrast of tissue: blood takes the blue, and red is near saturation.
Grid<std::uint8_t> tracked_picture(const Rgb8Image& frame);

// Where the frames of a clip show tissue that features can lie on: inside the field of view, away
// from its rim, from highlights, from instruments and from what a recorder has laid over them. All
// of it is looked for at half size.
class UsablePixels {
 public:
  // What moves slowly is looked for in one of so many frames.
  // `insets`: of the frames' size (InsetFinder), or of none.
  explicit UsablePixels(std::size_t look_every = 5, const Mask& insets = {});
  // Of the next frame of the clip, in its size; non-zero = usable.
  Mask next(const Rgb8Image& frame);
  // The share of a frame that instruments covered when they were last looked for, and whether all
  // was as grey then as no tissue is.
  double instruments_now() const { return instruments_now_; }
  bool is_colourless_now() const { return colourless_; }
  // The middle of the endoscope's round stop, on which its lens's axis lies (pixels; the mean of
  // the frames looked at); nothing where most of them show none.
  std::optional<Eigen::Vector2d> stop_center() const;

 private:
  void look_for_what_is_slow(const Rgb8Image& half);

  std::size_t look_every_, count_ = 0, looked_ = 0, round_ = 0;
  Eigen::Vector2d centers_ = Eigen::Vector2d::Zero();  // their sum, at half size
  double instruments_now_ = 0;
  bool colourless_ = false;
  Mask insets_, field_, slow_;  // at half size; no insets = of no size
};

struct TrackingOptions {
  // Aimed at in each frame; up to ten times as many are looked for where few of them survive.
  int features = 2000;
  int refill_every = 5;        // frames after which lost features are replaced by new ones
  double most_apart_px = 0.5;  // between a feature and where it is tracked back to
};

// Follows corners of the tissue through a clip by pyramidal Lucas–Kanade (Bouguet 2000), each step
// checked by tracking it backwards. Lost ones are replaced evenly over the picture, at once where
// most are lost, and by the more the fewer survive. Deterministic for any number of threads.
class FeatureTracker {
 public:
  explicit FeatureTracker(const TrackingOptions& options = {});
  ~FeatureTracker();
  FeatureTracker(FeatureTracker&&) noexcept;

  // The next frame, of one size, as tracked_picture() makes it. Features lie, and stay, where
  // `usable` is not zero (the frame's size): not at the rim, on highlights and on instruments,
  // which move otherwise than tissue.
  void add(const Grid<std::uint8_t>& picture, const Mask& usable);
  // What was followed so far.
  const ClipTracks& clip() const;
  // The same for good; the tracker is empty then.
  ClipTracks take();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace organbake
