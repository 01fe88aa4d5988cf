// SPDX-License-Identifier: Apache-2.0
#include "body/skin_give.h"

#include <utility>

namespace organbake::deform {

SkinGive::SkinGive(std::uint32_t first_slot, std::vector<Place> places,
                   const std::vector<std::vector<Carrier>>& shares)
    : first_slot_(first_slot), places_(std::move(places)), followers_(places_.size()) {
  std::uint32_t slot = first_slot;
  for (const std::vector<Carrier>& point : shares) {
    shares_.insert(shares_.end(), point.begin(), point.end());
    first_.push_back(static_cast<std::uint32_t>(shares_.size()));
    for (const auto& [place, weight] : point) followers_[place].push_back({slot, weight});
    ++slot;
  }
}

std::span<const Carrier> SkinGive::places_of(std::uint32_t slot) const {
  const std::size_t point = slot - first_slot_;
  if (slot < first_slot_ || point + 1 >= first_.size()) return {};
  return std::span(shares_).subspan(first_[point], first_[point + 1] - first_[point]);
}

void SkinGive::relax(PaddedVectors& given) const {
  constexpr double kNothing_mm = 1e-9;
  for (std::size_t p = 0; p < places_.size(); ++p) {
    given[p] *= places_[p].kept;
    if (given[p].squaredNorm() < kNothing_mm * kNothing_mm) given[p].setZero();
  }
}

void SkinGive::move_points(const PaddedVectors& given, PaddedVectors& x) const {
  for (std::size_t p = 0; p < places_.size(); ++p) {
    if (given[p].isZero(0)) continue;
    for (const auto& [slot, weight] : followers_[p]) x[slot] += weight * given[p];
  }
}

}  // namespace organbake::deform
