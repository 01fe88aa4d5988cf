// SPDX-License-Identifier: Apache-2.0
#include "body/skin_give.h"

#include <algorithm>
#include <utility>

namespace organbake::deform {

SkinGive::SkinGive(std::uint32_t first_slot, std::vector<Place> places,
                   const std::vector<std::vector<Carrier>>& shares)
    : first_slot_(first_slot), places_(std::move(places)) {
  for (const std::vector<Carrier>& point : shares) {
    shares_.insert(shares_.end(), point.begin(), point.end());
    first_.push_back(static_cast<std::uint32_t>(shares_.size()));
  }
}

std::span<const Carrier> SkinGive::places_of(std::uint32_t slot) const {
  const std::size_t point = slot - first_slot_;
  if (slot < first_slot_ || point + 1 >= first_.size()) return {};
  return std::span(shares_).subspan(first_[point], first_[point + 1] - first_[point]);
}

void SkinGive::relax(PaddedVectors& given) const {
  for (std::size_t p = 0; p < places_.size(); ++p) given[p] *= places_[p].kept;
}

void SkinGive::move_points(const PaddedVectors& given, PaddedVectors& x) const {
  const auto given_way = [](const PaddedVector& place) { return !place.isZero(0); };
  if (std::none_of(given.begin(), given.end(), given_way)) return;
  for (std::uint32_t point = 0; point + 1 < first_.size(); ++point)
    for (const auto& [place, weight] : places_of(first_slot_ + point))
      x[first_slot_ + point] += weight * given[place];
}

}  // namespace organbake::deform
