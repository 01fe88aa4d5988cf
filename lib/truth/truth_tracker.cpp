// SPDX-License-Identifier: Apache-2.0
#include "truth/truth_tracker.h"

#include "core/error.h"

namespace organbake {

void TruthTracker::advance(const Player& player, const View& view, const std::vector<Solid>& tools,
                           Frame& picture) {
  if (picture.bound.empty())
    throw UsageError("the truth of a picture needs it drawn with its bound pixels kept");
  ++pictures_;
  moments_[pictures_ % 2].take(player, view, tools);
  take_pixels(moments_[pictures_ % 2], layers_, picture, truths_[pictures_ % 2]);
}

}  // namespace organbake
