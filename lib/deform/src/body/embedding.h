// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "contact/padded_vector.h"

namespace organbake::deform {

// A point that four others carry: by the shares (weights) of their slots.
struct CarriedPoint {
  std::array<std::uint32_t, 4> slots{};
  std::array<double, 4> weights{};
};

// Points that have no motion of their own. They stand in a row of slots behind the free ones, so
// that skin and contacts meet them like any other; what pushes them pushes their carriers.
class Embedding {
 public:
  Embedding() = default;
  // The points get the slots from `first_slot` on; carriers with lower slots are free, all others
  // are anchors.
  Embedding(std::uint32_t first_slot, std::vector<CarriedPoint> points);

  std::size_t count() const { return points_.size(); }
  double free_share(std::uint32_t slot) const { return free_shares_[slot - first_slot_]; }

  // Sets the carried rows of displacements from their carriers', anchors' taken for 0.
  void carry(PaddedVectors& displacements) const;
  // The same for positions (mm), by how far the carriers are from rest.
  void carry_positions(const PaddedVectors& rest, PaddedVectors& x) const;
  // Adds to one lane of the free rows what a unit force on a carried slot does to them.
  void spread_force(std::uint32_t slot, double force, Eigen::Index lane, PaddedVectors& rows) const;
  // Moves the forces on carried rows to their free carriers.
  void spread(PaddedVectors& force) const;

 private:
  std::uint32_t first_slot_ = 0;
  std::vector<CarriedPoint> points_;  // the weights of anchors are 0, of slot 0
  std::vector<double> free_shares_;
};

}  // namespace organbake::deform
