// SPDX-License-Identifier: Apache-2.0
#include "solver/compliance_columns.h"

#include <algorithm>
#include <memory>
#include <utility>

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
  std::fill(scratch_.begin(), scratch_.end(), PaddedVector::Zero());
  for (std::size_t lane = 0; lane < count; ++lane) put(slots[lane], 1, lane);
  solve();
  for (std::size_t lane = 0; lane < count; ++lane) {
    place_of_slot_[slots[lane]] = static_cast<std::uint32_t>(columns_.size());
    read(lane, columns_.emplace_back());
  }
}

void ComplianceColumns::make(std::span<CarrierResponse* const> responses) {
  std::fill(scratch_.begin(), scratch_.end(), PaddedVector::Zero());
  for (std::size_t lane = 0; lane < responses.size(); ++lane) {
    for (const auto& [slot, weight] : responses[lane]->carriers)
      put(slot, responses[lane]->scale * weight, lane);
  }
  solve();
  for (std::size_t lane = 0; lane < responses.size(); ++lane) {
    std::vector<double> column;
    read(lane, column);
    responses[lane]->column = std::make_shared<const std::vector<double>>(std::move(column));
  }
}

// A force on a slot, among those of its lane.
void ComplianceColumns::put(std::uint32_t slot, double weight, std::size_t lane) {
  const auto column = static_cast<Eigen::Index>(lane);
  if (slot < tissue_.free_count()) {
    scratch_[slot][column] += weight;
  } else {
    tissue_.embedding().spread_force(slot, weight, column, scratch_);
  }
}

void ComplianceColumns::solve() {
  tissue_.factor().solve(scratch_.data());
  tissue_.embedding().carry(scratch_);
}

void ComplianceColumns::read(std::size_t lane, std::vector<double>& column) const {
  column.resize(scratch_.size());
  for (std::size_t i = 0; i < column.size(); ++i)
    column[i] = scratch_[i][static_cast<Eigen::Index>(lane)];
}

}  // namespace organbake::deform
