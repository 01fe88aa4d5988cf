// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include "organbake/volume/label_box.h"
#include "organbake/volume/volume.h"

namespace organbake {

// How many voxels high the steps of a label's staircase are along each axis: 1 for a mask drawn on
// its own grid; 3 for one drawn at 3 mm and brought onto a grid of 1 mm by nearest neighbour, as
// segmentation networks do, whose stairs are then 3 mm. Read off the steps between neighbouring
// columns: slopes make steps of every height, but only a finer grid has none of 1.
Eigen::Vector3d stair_height_voxels(const Volume& mask, int label, const LabelBox& box);

}  // namespace organbake
