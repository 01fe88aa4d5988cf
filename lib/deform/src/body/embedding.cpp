// SPDX-License-Identifier: Apache-2.0
#include "body/embedding.h"

namespace organbake::deform {

Embedding::Embedding(std::uint32_t first_slot, const std::vector<std::vector<Carrier>>& points)
    : first_slot_(first_slot) {
  if (first_slot == 0) return;  // nothing moves, nor is carried
  for (const std::vector<Carrier>& point : points) {
    double share = 0;
    bool whole = true;
    for (const auto& [slot, weight] : point) {
      if (weight == 0) continue;
      whole = whole && slot < first_slot;
      if (slot >= first_slot) continue;
      share += weight;
      carriers_.push_back({slot, weight});
    }
    first_.push_back(static_cast<std::uint32_t>(carriers_.size()));
    free_shares_.push_back(whole ? 1 : share);  // a sum of weights may be off by rounding
  }
}

void Embedding::carry(PaddedVectors& displacements) const {
  Double4* rows = as_double4(displacements.data());
  for (std::size_t i = 0; i < count(); ++i) {
    Double4 moved{};
    for (const auto& [slot, weight] : carriers_of(i)) moved += weight * rows[slot];
    rows[first_slot_ + i] = moved;
  }
}

void Embedding::carry_positions(const PaddedVectors& rest, PaddedVectors& x) const {
  Double4* at = as_double4(x.data());
  const Double4* from = as_double4(rest.data());
  for (std::size_t i = 0; i < count(); ++i) {
    Double4 moved{};
    for (const auto& [slot, weight] : carriers_of(i)) moved += weight * (at[slot] - from[slot]);
    at[first_slot_ + i] = from[first_slot_ + i] + moved;
  }
}

void Embedding::spread_force(std::uint32_t slot, double force, Eigen::Index lane,
                             PaddedVectors& rows) const {
  for (const auto& [carrier, weight] : carriers_of(slot - first_slot_))
    rows[carrier][lane] += force * weight;
}

void Embedding::spread(PaddedVectors& force) const {
  for (std::size_t i = 0; i < count(); ++i) {
    PaddedVector& own = force[first_slot_ + i];
    for (const auto& [slot, weight] : carriers_of(i)) force[slot] += weight * own;
    own.setZero();
  }
}

}  // namespace organbake::deform
