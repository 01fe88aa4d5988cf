// SPDX-License-Identifier: Apache-2.0
#include "organbake/truth/truth_tracker.h"

#include "organbake/core/error.h"

namespace organbake {

void TruthTracker::advance(const Player& player, const View& view, const std::vector<Solid>& tools,
                           Frame& picture) {
  for (std::size_t organ = 0; organ < player.organ_count(); ++organ) {
    if (player.is_cut(organ))
      throw UsageError("the truth of a picture is told of organs as they were baked, and '" +
                       player.bundle(organ).manifest.name +
                       "' has been cut; leave out the layers, or the blade");
  }
  std::vector<DrawnOrgan> organs;
  for (std::size_t o = 0; o < player.organ_count(); ++o)
    organs.push_back({player.bundle(o).base, player.shell_matrices(o)});
  advance(organs, view, tools, picture);
}

void TruthTracker::advance(const std::vector<DrawnOrgan>& organs, const View& view,
                           const std::vector<Solid>& tools, Frame& picture) {
  if (picture.bound.empty())
    throw UsageError("the truth of a picture needs it drawn with its bound pixels kept");
  ++pictures_;
  moments_[pictures_ % 2].take(organs, view, tools);
  take_pixels(moments_[pictures_ % 2], layers_, picture, truths_[pictures_ % 2]);
}

}  // namespace organbake
