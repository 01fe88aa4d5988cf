// SPDX-License-Identifier: Apache-2.0
// A contact's constrained point and the force that it hands on to the vertices that carry it, for
// all kinds of contacts.
#include "contact/contact.h"

namespace organbake::deform {

VertexResponse against(const VertexResponse& point, const VertexResponse& other) {
  VertexResponse both = point;
  both.count = 6;
  for (int k = 0; k < 3; ++k) {
    both.slots[3 + k] = other.slots[k];
    both.weights[3 + k] = -other.weights[k];
  }
  both.free_share = std::max(point.free_share, other.free_share);
  return both;
}

void share_out_force(const Contact& contact, PaddedVectors& on_slots) {
  std::vector<Carrier> answer;
  if (const Carried* carried = contact.as<Carried>()) {
    answer = carried->response.carriers;
  } else {
    for (int k = 0; k < 3; ++k)
      answer.push_back({contact.response.slots[k], contact.response.weights[k]});
  }
  double sum = 0;
  for (const Carrier& carrier : answer) sum += carrier.weight;
  for (const Carrier& carrier : answer)
    on_slots[carrier.slot] += carrier.weight / sum * contact.felt_force();
}

PaddedVector constrained_point(const Contact& contact, const PaddedVectors& x,
                               const PaddedVectors& rest) {
  PaddedVector point = contact.anchored_at;
  if (const Carried* carried = contact.as<Carried>()) {
    for (const auto& [slot, weight] : carried->response.carriers)
      point += carried->response.scale * weight * (x[slot] - rest[slot]);
    return point;
  }
  for (int k = 0; k < contact.response.count; ++k) {
    const std::uint32_t slot = contact.response.slots[k];
    point += contact.response.weights[k] * (x[slot] - rest[slot]);
  }
  return point;
}

}  // namespace organbake::deform
