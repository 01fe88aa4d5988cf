// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "body/tissue.h"
#include "contact/contact.h"
#include "contact/padded_vector.h"

namespace organbake::deform {

// Columns of A⁻¹ (mm per mN) for the points that contacts touch, carried ones among them: made when
// first asked for and kept over the steps, because A never changes.
class ComplianceColumns {
 public:
  explicit ComplianceColumns(const Tissue& tissue);

  // Makes the columns of `slots` (all moving) that are missing, four at a time. May drop others.
  void require(const std::vector<std::uint32_t>& slots);
  // Makes the columns of up to four carrier responses.
  void make(std::span<CarrierResponse* const> responses);
  // moving_count values; valid until the next require().
  const double* column(std::uint32_t slot) const { return columns_[place_of_slot_[slot]].data(); }

 private:
  void make(const std::uint32_t* slots, std::size_t count);
  void put(std::uint32_t slot, double weight, std::size_t lane);
  void solve();
  void read(std::size_t lane, std::vector<double>& column) const;

  const Tissue& tissue_;
  std::size_t capacity_;
  std::vector<std::uint32_t> place_of_slot_;
  std::vector<std::vector<double>> columns_;
  PaddedVectors scratch_;
};

}  // namespace organbake::deform
