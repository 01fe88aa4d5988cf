// SPDX-License-Identifier: Apache-2.0
// A page has no blades, and is a seventh smaller without what they take.
#include <algorithm>

#include "core/error.h"
#include "player/player.h"

namespace organbake {

void Player::cut(const std::vector<InstrumentTip>& tips) {
  const auto cuts = [](const InstrumentTip& tip) { return tip.active && has_blade(tip.mode); };
  if (std::any_of(tips.begin(), tips.end(), cuts))
    throw UsageError("an instrument cuts, which a page cannot; play the script with organplay");
}

void Player::leave_holes(const std::vector<InstrumentTip>&, const std::vector<ContactPoint>&) {}

std::size_t Player::piece_count(std::size_t) const { return 1; }

}  // namespace organbake
