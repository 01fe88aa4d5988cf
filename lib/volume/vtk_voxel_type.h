// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>

#include "volume/voxel_decoding.h"

namespace organbake {

// A VTK scalar type (VTK_SHORT …) as ours; nothing for bits, strings and objects.
std::optional<VoxelType> voxel_type_of_vtk(int vtk_type);

}  // namespace organbake
