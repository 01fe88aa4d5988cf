// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>

#include "organbake/volume/region.h"
#include "organbake/volume/volume.h"

namespace organbake {

// The smallest box of voxels that holds a label.
struct LabelBox {
  std::array<int, 3> first{}, size{};
  std::size_t label_voxels = 0;  // 0 when the label is absent
};
LabelBox bounding_box(const Volume& mask, int label);

// The box of the world that holds a label's voxels with those around them, and what lies one voxel
// beyond: all of a scan that is asked about the label.
Region region_around(const Volume& mask, const LabelBox& box);

}  // namespace organbake
