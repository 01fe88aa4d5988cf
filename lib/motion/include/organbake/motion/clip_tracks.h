// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

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

}  // namespace organbake
