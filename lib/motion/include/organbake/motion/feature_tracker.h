// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "organbake/motion/clip_tracks.h"
#include "organbake/shading/grid.h"

namespace organbake {

struct TrackingOptions {
  int features = 2000;         // aimed at in each frame
  int refill_every = 5;        // frames after which lost features are replaced by new ones
  double most_apart_px = 0.5;  // between a feature and where it is tracked back to

  void check() const;  // throws UsageError
};

// Follows corners of the tissue through a clip by pyramidal Lucas–Kanade (Bouguet 2000), each step
// checked by tracking it backwards. Lost ones are replaced evenly over the picture. The picture's
// contrast is evened out first (CLAHE): tissue is pale, and its brightness goes with the lamp.
// Deterministic for any number of threads.
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
