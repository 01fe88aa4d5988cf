// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "volume/volume.h"

namespace organbake {

// What is contoured: the volume's own voxels, or a copy where one is needed.
struct ContourField {
  std::span<const std::int16_t> values;
  std::array<int, 3> size{};
  int margin = 0;                  // voxels added on every side
  std::vector<std::int16_t> copy;  // empty when `values` are the volume's own
};

// Prepares a volume for contouring at `level`, a half-integer. With `cap`, a volume that the
// surface would leave through its border gets one voxel of air around it, each the mirror image of
// its neighbour at the level: the crossing then falls half-way, on the outer side of the last
// voxel, so the cap is flat and the voxels keep their whole thickness.
ContourField contour_field(const Volume& volume, const ValueRange& range, double level, bool cap);

}  // namespace organbake
