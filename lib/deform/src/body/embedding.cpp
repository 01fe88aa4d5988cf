// SPDX-License-Identifier: Apache-2.0
#include "body/embedding.h"

#include <utility>

namespace organbake::deform {

Embedding::Embedding(std::uint32_t first_slot, std::vector<CarriedPoint> points)
    : first_slot_(first_slot), points_(std::move(points)) {
  for (CarriedPoint& point : points_) {
    double share = 0;
    bool whole = true;
    for (int k = 0; k < 4; ++k) {
      if (point.slots[k] < first_slot) {
        share += point.weights[k];
      } else {
        whole = whole && point.weights[k] == 0;
        point.slots[k] = 0;
        point.weights[k] = 0;
      }
    }
    free_shares_.push_back(whole ? 1 : share);  // a sum of weights may be off by rounding
  }
  if (first_slot == 0) points_.clear(), free_shares_.clear();  // nothing moves, nor is carried
}

void Embedding::carry(PaddedVectors& displacements) const {
  Double4* rows = as_double4(displacements.data());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const auto& [slots, weights] = points_[i];
    rows[first_slot_ + i] = weights[0] * rows[slots[0]] + weights[1] * rows[slots[1]] +
                            weights[2] * rows[slots[2]] + weights[3] * rows[slots[3]];
  }
}

void Embedding::carry_positions(const PaddedVectors& rest, PaddedVectors& x) const {
  Double4* at = as_double4(x.data());
  const Double4* from = as_double4(rest.data());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    Double4 moved{};
    for (int k = 0; k < 4; ++k) {
      const std::uint32_t slot = points_[i].slots[k];
      moved += points_[i].weights[k] * (at[slot] - from[slot]);
    }
    at[first_slot_ + i] = from[first_slot_ + i] + moved;
  }
}

void Embedding::spread_force(std::uint32_t slot, double force, Eigen::Index lane,
                             PaddedVectors& rows) const {
  const auto& [slots, weights] = points_[slot - first_slot_];
  for (int k = 0; k < 4; ++k) rows[slots[k]][lane] += force * weights[k];
}

void Embedding::spread(PaddedVectors& force) const {
  for (std::size_t i = 0; i < points_.size(); ++i) {
    PaddedVector& own = force[first_slot_ + i];
    for (int k = 0; k < 4; ++k) force[points_[i].slots[k]] += points_[i].weights[k] * own;
    own.setZero();
  }
}

}  // namespace organbake::deform
