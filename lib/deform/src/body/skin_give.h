// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "body/embedding.h"
#include "contact/padded_vector.h"

namespace organbake::deform {

// Skin that lies on its tissue by springs with dampers beside them: what presses on it moves it
// beyond what carries it, as far as a dent is narrower than what carries it can show. Each place of
// the skin as it was baked has one, and points of the skin follow places by shares of their motion.
class SkinGive {
 public:
  struct Place {
    double mm_per_mn = 0;  // by a force in one step
    double kept = 0;       // share of how far it has given way that is left after a step
  };

  SkinGive() = default;
  // shares: of the points in the slots from first_slot on, by places.
  SkinGive(std::uint32_t first_slot, std::vector<Place> places,
           const std::vector<std::vector<Carrier>>& shares);

  // The places that a slot follows; none of one that is no point of the skin.
  std::span<const Carrier> places_of(std::uint32_t slot) const;
  double mm_per_mn(std::uint32_t place) const { return places_[place].mm_per_mn; }
  // How far the places have given way (mm) where nothing has yet.
  PaddedVectors none() const { return PaddedVectors(places_.size(), PaddedVector::Zero()); }
  // The same a step later, when nothing presses on them any more.
  void relax(PaddedVectors& given) const;
  // Moves the points of the skin by what their places have given way.
  void move_points(const PaddedVectors& given, PaddedVectors& x) const;

 private:
  std::uint32_t first_slot_ = 0;
  std::vector<Place> places_;
  std::vector<std::uint32_t> first_ = {0};  // of each point's shares, and the end
  std::vector<Carrier> shares_;
  // By place, the points that follow it: a tool moves few places of a skin.
  std::vector<std::vector<Carrier>> followers_;
};

}  // namespace organbake::deform
