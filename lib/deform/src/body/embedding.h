// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "contact/padded_vector.h"

namespace organbake::deform {

// What a point follows, by a share of its motion.
struct Carrier {
  std::uint32_t slot;
  double weight;
};

// Points that have no motion of their own. They stand in a row of slots behind the free ones, so
// that skin and contacts meet them like any other; what pushes them pushes their carriers.
class Embedding {
 public:
  Embedding() = default;
  // The points get the slots from `first_slot` on; carriers with lower slots are free, all others
  // are anchors.
  Embedding(std::uint32_t first_slot, const std::vector<std::vector<Carrier>>& points);

  std::size_t count() const { return free_shares_.size(); }
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
  std::span<const Carrier> carriers_of(std::size_t point) const {
    return std::span(carriers_).subspan(first_[point], first_[point + 1] - first_[point]);
  }

  std::uint32_t first_slot_ = 0;
  std::vector<std::uint32_t> first_ = {0};  // of each point's carriers, and the end
  std::vector<Carrier> carriers_;           // that are free
  std::vector<double> free_shares_;
};

}  // namespace organbake::deform
