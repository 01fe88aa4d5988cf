// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/view_choice.h"

#include <algorithm>

namespace organbake {
namespace {

// The sharpest of the second half of the way from the last view.
std::size_t sharpest_of(const std::vector<double>& sharpness, std::size_t last, std::size_t now) {
  const std::size_t middle = last + 1 + (now - last) / 2;
  std::size_t best = now;
  for (std::size_t frame = middle; frame < now; ++frame)
    if (sharpness[frame] > sharpness[best]) best = frame;
  return best;
}

std::vector<std::size_t> by_motion(double motion_px, std::size_t most_apart, const ClipTracks& clip,
                                   const std::vector<double>& sharpness, std::size_t first,
                                   std::size_t end) {
  std::vector<std::size_t> views = {first};
  for (std::size_t frame = first + 1; frame < end; ++frame) {
    const std::size_t last = views.back();
    const bool moved = motion_between(clip, last, frame).median_px >= motion_px;
    if (!moved && frame - last < most_apart && frame + 1 < end) continue;
    views.push_back(sharpest_of(sharpness, last, frame));
    frame = views.back();
  }
  return views;
}

}  // namespace

std::vector<std::size_t> choose_views(const ViewChoice& choice, const ClipTracks& clip,
                                      const std::vector<double>& sharpness, std::size_t first,
                                      std::size_t end) {
  if (first >= end) return {};
  double motion_px = choice.motion_share * clip.width;
  std::size_t most_apart = choice.most_apart;
  while (true) {
    std::vector<std::size_t> views = by_motion(motion_px, most_apart, clip, sharpness, first, end);
    if (views.size() <= choice.most_views) return views;
    motion_px *= 1.3;
    most_apart += most_apart / 3 + 1;
  }
}

}  // namespace organbake
