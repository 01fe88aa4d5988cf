// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include <vector>

#include "organbake/deform/deformer.h"

namespace organbake {

// The arguments of step() as they are given.
struct TipArguments {
  pybind11::object radius_mm, axis_mm, grabs, cuts, snips, opening_mm, cut_width_mm, pierces,
      active;
};

// Throws a UsageError, Python's ValueError, that names the argument or the tip.
std::vector<InstrumentTip> tips_from(const pybind11::object& positions_mm, const TipArguments& all);

}  // namespace organbake
