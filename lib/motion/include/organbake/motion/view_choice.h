// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <vector>

#include "organbake/motion/clip_tracks.h"

namespace organbake {

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

}  // namespace organbake
