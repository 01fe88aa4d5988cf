// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "organbake/instruments/instrument.h"

namespace organbake {

// One instrument's way through a time step: in a straight line, its axis likewise.
struct InstrumentSweep {
  std::uint32_t instrument = 0;  // its place in the list
  Instrument from, to;           // but for position and axis they are the same
  // No earlier place is known: skin that the tip overlaps counts as entered from outside.
  bool just_placed = false;

  Eigen::Vector3d position_mm(double fraction) const {
    return from.position_mm + fraction * (to.position_mm - from.position_mm);
  }
  Eigen::Vector3d axis_mm(double fraction) const {
    return from.axis_mm + fraction * (to.axis_mm - from.axis_mm);
  }
  // Of the place `along` (0…1) the axis.
  Eigen::Vector3d motion_mm(double along) const {
    return (to.position_mm - from.position_mm) + along * (to.axis_mm - from.axis_mm);
  }
};

// Whether nothing about the active instruments differs by more than rounding.
bool unchanged(const std::vector<Instrument>& before, const std::vector<Instrument>& now);

// The way of every active instrument, in their order. One that was not there before, or was of
// another kind, is just placed.
std::vector<InstrumentSweep> sweeps_between(const std::vector<Instrument>& before,
                                            const std::vector<Instrument>& now);

}  // namespace organbake
