// SPDX-License-Identifier: Apache-2.0
#include "deform/contact.h"

namespace organbake::deform {

Row constrained_point(const Contact& contact, const Rows& x, const Rows& rest) {
  Row point = contact.anchored_at;
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t slot = contact.lever.slots[k];
    point += contact.lever.weights[k] * (x[slot] - rest[slot]);
  }
  return point;
}

}  // namespace organbake::deform
