// SPDX-License-Identifier: Apache-2.0
#include "organbake/instruments/instrument.h"

#include <string>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/rigid_transform.h"

namespace organbake {
namespace {

std::string describe(const Eigen::Vector3d& p) {
  return "(" + to_text(p.x()) + ", " + to_text(p.y()) + ", " + to_text(p.z()) + ")";
}

void check_sharp(const Instrument& instrument, const std::string& name) {
  if (!(instrument.axis_mm.norm() >= kShortestBlade_mm)) {
    throw UsageError(name + " cuts or pierces and has the axis " + describe(instrument.axis_mm) +
                     " mm; give its blade's edge or its needle, from the tip to the upper end, or "
                     "from the tips of scissors to their pivot, of 0.1 mm at least");
  }
  const Scissors* scissors = std::get_if<Scissors>(&instrument.kind);
  if (scissors && !within_reach(scissors->opening_mm)) {
    throw UsageError(name + " has the opening " + describe(scissors->opening_mm) +
                     " mm; give a finite one within 1e9 mm, zero for closed scissors");
  }
}

void check_numbers(const InstrumentKind& kind, const std::string& name) {
  const auto check = [&](const InstrumentNumber& number, double value) {
    if (value >= number.least && value <= number.most) return;
    throw UsageError(name + " has " + number.name + " " + to_text(value) + "; it must be " +
                     to_text(number.least) + " to " + to_text(number.most));
  };
  std::visit([&](const auto& own) { each_number(own, check); }, kind);
}

}  // namespace

const std::array<InstrumentKind, std::variant_size_v<InstrumentKind>>& instrument_kinds() {
  static const std::array<InstrumentKind, std::variant_size_v<InstrumentKind>> kinds = {
      Ball{}, Grasper{}, Blade{}, Scissors{}, Needle{}};
  return kinds;
}

std::optional<InstrumentKind> kind_of_mode(std::string_view mode) {
  for (const InstrumentKind& kind : instrument_kinds())
    if (mode == mode_of(kind)) return kind;
  return std::nullopt;
}

void check_instruments(const std::vector<Instrument>& instruments) {
  if (instruments.size() > kMostInstruments) {
    throw UsageError("there are " + std::to_string(instruments.size()) + " instrument tips; " +
                     std::to_string(kMostInstruments) + " at most are followed");
  }
  for (std::size_t i = 0; i < instruments.size(); ++i) {
    const Instrument& instrument = instruments[i];
    if (!instrument.active) continue;
    const std::string name = "instrument tip " + std::to_string(i);
    if (!within_reach(instrument.position_mm)) {
      throw UsageError(name + " is at " + describe(instrument.position_mm) +
                       " mm; give a finite position within 1e9 mm");
    }
    if (!within_reach(instrument.axis_mm)) {
      throw UsageError(name + " has the axis " + describe(instrument.axis_mm) +
                       " mm; give a finite one within 1e9 mm, zero for a sphere");
    }
    if (!(instrument.radius_mm >= kThinnestTip_mm) || instrument.radius_mm > kFarthest_mm) {
      throw UsageError(name + " has radius " + to_text(instrument.radius_mm) + " mm; it must be " +
                       to_text(kThinnestTip_mm) + " to 1e9");
    }
    if (!instrument.is_blunt()) check_sharp(instrument, name);
    check_numbers(instrument.kind, name);
  }
}

}  // namespace organbake
