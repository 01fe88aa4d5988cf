// SPDX-License-Identifier: Apache-2.0
// The one place where flags become a kind: what an embedding program sees may not change with what
// an Instrument is inside.
#include "organbake/player/tip_instruments.h"

#include <string>

#include "organbake/core/error.h"

namespace organbake {
namespace {

InstrumentKind kind_of(const EmbeddedPlayer::Tip& tip, std::size_t place) {
  if (tip.grabs + tip.cuts + tip.snips + tip.pierces > 1)
    throw UsageError("tip " + std::to_string(place) +
                     " does more than one of grabs, cuts, snips and pierces");
  if (tip.pierces) return Needle{};
  if (tip.snips) return Scissors{tip.cut_width_mm, Eigen::Vector3d(tip.opening_mm.data())};
  if (tip.cuts) return Blade{tip.cut_width_mm};
  if (tip.grabs) return Grasper{};
  return Ball{};
}

}  // namespace

std::vector<Instrument> instruments_from(const std::vector<EmbeddedPlayer::Tip>& tips) {
  std::vector<Instrument> instruments;
  for (const EmbeddedPlayer::Tip& tip : tips) {
    instruments.push_back({Eigen::Vector3d(tip.position_mm.data()), tip.radius_mm,
                           kind_of(tip, instruments.size()), tip.active,
                           Eigen::Vector3d(tip.axis_mm.data())});
  }
  return instruments;
}

}  // namespace organbake
