// SPDX-License-Identifier: GPL-3.0-or-later
// The door of the module organbake_contouring, which alone links VTK's contour filters and the
// dozen libraries behind them.
#pragma once

#include "organbake/contour/contour.h"

namespace organbake {

struct ContouredGrid {
  std::span<const std::int16_t> whole;  // one of the two
  std::span<const float> real;
  std::array<int, 3> size;
  double level;
};

}  // namespace organbake

extern "C" __attribute__((visibility("default"))) void organbake_contour(
    const organbake::ContouredGrid& grid, organbake::TriangleMesh& surface);
