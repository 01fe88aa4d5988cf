// SPDX-License-Identifier: Apache-2.0
#include "deform/compliance_columns.h"

#include <algorithm>

namespace organbake::deform {
namespace {

constexpr std::uint32_t kAbsent = 0xFFFFFFFFu;
constexpr std::size_t kCacheBytes = std::size_t{64} << 20;
constexpr std::size_t kFewest = 512;  // more than the vertices of all contacts of a few tips

}  // namespace

ComplianceColumns::ComplianceColumns(const Tissue& tissue)
    : tissue_(tissue),
      capacity_(std::max(kFewest, kCacheBytes / (sizeof(double) * (tissue.moving_count() + 1)))),
      place_of_slot_(tissue.moving_count(), kAbsent),
      scratch_(tissue.moving_count()) {}

void ComplianceColumns::require(const std::vector<std::uint32_t>& slots) {
  std::vector<std::uint32_t> missing;
  for (const std::uint32_t slot : slots) {
    if (place_of_slot_[slot] == kAbsent) missing.push_back(slot);
  }
  if (missing.empty()) return;
  if (columns_.size() + missing.size() > capacity_) {
    columns_.clear();
    std::fill(place_of_slot_.begin(), place_of_slot_.end(), kAbsent);
    missing = slots;
  }
  for (std::size_t i = 0; i < missing.size(); i += 4) {
    make(missing.data() + i, std::min<std::size_t>(4, missing.size() - i));
  }
}

void ComplianceColumns::make(const std::uint32_t* slots, std::size_t count) {
  std::fill(scratch_.begin(), scratch_.end(), Row::Zero());
  for (std::size_t lane = 0; lane < count; ++lane) {
    const auto column = static_cast<Eigen::Index>(lane);
    if (slots[lane] < tissue_.free_count()) {
      scratch_[slots[lane]][column] = 1;
    } else {
      tissue_.embedding().spread_unit(slots[lane], column, scratch_);
    }
  }
  tissue_.factor().solve(scratch_.data());
  tissue_.embedding().carry(scratch_);
  for (std::size_t lane = 0; lane < count; ++lane) {
    place_of_slot_[slots[lane]] = static_cast<std::uint32_t>(columns_.size());
    auto& column = columns_.emplace_back(scratch_.size());
    for (std::size_t i = 0; i < column.size(); ++i) {
      column[i] = scratch_[i][static_cast<Eigen::Index>(lane)];
    }
  }
}

}  // namespace organbake::deform
