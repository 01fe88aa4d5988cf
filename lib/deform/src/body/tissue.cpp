// SPDX-License-Identifier: Apache-2.0
#include "body/tissue.h"

namespace organbake::deform {

void Tissue::take_organs_for_pieces() {
  piece_of_slot_ = organ_of_slot_;
  for (std::size_t slot = 0; slot < size(); ++slot) {
    while (pieces_.size() <= organ_of_slot_[slot])
      pieces_.push_back({false, false, static_cast<std::uint32_t>(pieces_.size())});
    if (slot >= moving_count()) pieces_[organ_of_slot_[slot]].held = true;
  }
}

void Tissue::put_inertia(const PaddedVectors& x, const PaddedVectors& x_coasted,
                         PaddedVectors& force) const {
  const Double4* at = as_double4(x.data());
  const Double4* coasted = as_double4(x_coasted.data());
  Double4* sum = as_double4(force.data());
  for (std::size_t i = 0; i < free_count(); ++i) sum[i] = inertia_[i] * (coasted[i] - at[i]);
  for (std::size_t i = free_count(); i < size(); ++i) sum[i] = Double4{};
}

double Tissue::twice_kinetic_energy(const PaddedVectors& x, const PaddedVectors& x_start) const {
  const Double4* at = as_double4(x.data());
  const Double4* from = as_double4(x_start.data());
  double twice = 0;
  for (std::size_t i = 0; i < free_count(); ++i) {
    const Double4 move = at[i] - from[i];
    twice += inertia_[i] * dot(move, move);
  }
  return twice;
}

}  // namespace organbake::deform
