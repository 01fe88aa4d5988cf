// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/dicom_pixels.h"

#include <vtkType.h>

namespace organbake {

std::optional<VoxelType> voxel_type_of_vtk(int vtk_type) {
  constexpr bool kWideLong = sizeof(long) == 8;
  switch (vtk_type) {
    case VTK_CHAR:
    case VTK_SIGNED_CHAR:
      return VoxelType::int8;
    case VTK_UNSIGNED_CHAR:
      return VoxelType::uint8;
    case VTK_SHORT:
      return VoxelType::int16;
    case VTK_UNSIGNED_SHORT:
      return VoxelType::uint16;
    case VTK_INT:
      return VoxelType::int32;
    case VTK_UNSIGNED_INT:
      return VoxelType::uint32;
    case VTK_LONG:
      return kWideLong ? VoxelType::int64 : VoxelType::int32;
    case VTK_UNSIGNED_LONG:
      return kWideLong ? VoxelType::uint64 : VoxelType::uint32;
    case VTK_LONG_LONG:
    case VTK_ID_TYPE:
      return VoxelType::int64;
    case VTK_UNSIGNED_LONG_LONG:
      return VoxelType::uint64;
    case VTK_FLOAT:
      return VoxelType::float32;
    case VTK_DOUBLE:
      return VoxelType::float64;
    default:
      return std::nullopt;
  }
}

}  // namespace organbake
