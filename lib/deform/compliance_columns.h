// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "deform/rows.h"
#include "deform/sparse_factor.h"

namespace organbake::deform {

// Columns of A⁻¹ (mm per mN) for the vertices that contacts touch: made when first asked for and
// kept over the steps, because A never changes.
class ComplianceColumns {
 public:
  explicit ComplianceColumns(const SparseFactor& factor);

  // Makes the columns of `slots` (all free) that are missing, four at a time. May drop others.
  void require(const std::vector<std::uint32_t>& slots);
  // free_count values; valid until the next require().
  const double* column(std::uint32_t slot) const { return columns_[place_of_slot_[slot]].data(); }

 private:
  void make(const std::uint32_t* slots, std::size_t count);

  const SparseFactor& factor_;
  std::size_t capacity_;
  std::vector<std::uint32_t> place_of_slot_;
  std::vector<std::vector<double>> columns_;
  Rows scratch_;
};

}  // namespace organbake::deform
