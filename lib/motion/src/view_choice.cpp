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

}  // namespace

std::optional<std::size_t> next_view(const ViewChoice& choice, const ClipTracks& clip,
                                     const std::vector<double>& sharpness, std::size_t last,
                                     std::size_t end, bool over) {
  const double motion_px = choice.motion_share * clip.width;
  for (std::size_t frame = last + 1; frame < end; ++frame)
    if (frame - last >= choice.most_apart || (over && frame + 1 == end) ||
        motion_between(clip, last, frame).median_px >= motion_px)
      return sharpest_of(sharpness, last, frame);
  return std::nullopt;
}

std::vector<std::size_t> choose_views(const ViewChoice& choice, const ClipTracks& clip,
                                      const std::vector<double>& sharpness, std::size_t first,
                                      std::size_t end) {
  if (first >= end) return {};
  ViewChoice steps = choice;
  while (true) {
    std::vector<std::size_t> views = {first};
    while (const auto view = next_view(steps, clip, sharpness, views.back(), end, true))
      views.push_back(*view);
    if (views.size() <= choice.most_views) return views;
    steps.motion_share *= 1.3;
    steps.most_apart += steps.most_apart / 3 + 1;
  }
}

}  // namespace organbake
