// SPDX-License-Identifier: Apache-2.0
#include "body/tissue.h"

namespace organbake::deform {

void Tissue::put_inertia(const Rows& x, const Rows& x_coasted, Rows& force) const {
  const Lanes* at = as_lanes(x.data());
  const Lanes* coasted = as_lanes(x_coasted.data());
  Lanes* sum = as_lanes(force.data());
  for (std::size_t i = 0; i < free_count(); ++i) sum[i] = inertia_[i] * (coasted[i] - at[i]);
  for (std::size_t i = free_count(); i < size(); ++i) sum[i] = Lanes{};
}

double Tissue::twice_kinetic_energy(const Rows& x, const Rows& x_start) const {
  const Lanes* at = as_lanes(x.data());
  const Lanes* from = as_lanes(x_start.data());
  double twice = 0;
  for (std::size_t i = 0; i < free_count(); ++i) {
    const Lanes move = at[i] - from[i];
    twice += inertia_[i] * dot(move, move);
  }
  return twice;
}

}  // namespace organbake::deform
