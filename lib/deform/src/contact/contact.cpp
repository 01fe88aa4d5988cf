// SPDX-License-Identifier: Apache-2.0
#include "contact/contact.h"

namespace organbake::deform {

Lever against(const Lever& point, const Lever& other) {
  Lever both = point;
  both.count = 6;
  for (int k = 0; k < 3; ++k) {
    both.slots[3 + k] = other.slots[k];
    both.weights[3 + k] = -other.weights[k];
  }
  both.free_share = std::max(point.free_share, other.free_share);
  return both;
}

Row constrained_point(const Contact& contact, const Rows& x, const Rows& rest) {
  Row point = contact.anchored_at;
  if (const Carried* carried = contact.as<Carried>()) {
    for (const auto& [slot, weight] : carried->grip.carriers)
      point += carried->grip.scale * weight * (x[slot] - rest[slot]);
    return point;
  }
  for (int k = 0; k < contact.lever.count; ++k) {
    const std::uint32_t slot = contact.lever.slots[k];
    point += contact.lever.weights[k] * (x[slot] - rest[slot]);
  }
  return point;
}

}  // namespace organbake::deform
