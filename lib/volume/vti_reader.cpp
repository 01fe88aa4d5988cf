// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/vti_reader.h"

#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkMatrix3x3.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkXMLImageDataReader.h>

#include "core/error.h"
#include "formats/vtk_error_log.h"
#include "volume/grid.h"
#include "volume/sheared_grid.h"
#include "volume/voxel_decoding.h"
#include "volume/vtk_voxel_type.h"

namespace organbake {
namespace {

VoxelType type_of(vtkDataArray& array, const std::filesystem::path& path) {
  const std::optional<VoxelType> type = voxel_type_of_vtk(array.GetDataType());
  if (!type) throw BadDataError(path, "its values are not plain numbers");
  return *type;
}

vtkDataArray& scalars_of(vtkImageData& image, const std::filesystem::path& path) {
  vtkPointData* points = image.GetPointData();
  vtkDataArray* array = points->GetScalars();
  if (!array && points->GetNumberOfArrays() == 1) array = points->GetArray(0);
  if (!array) throw BadDataError(path, "has no point scalars");
  if (array->GetNumberOfComponents() != 1) {
    throw BadDataError(path, "has " + std::to_string(array->GetNumberOfComponents()) +
                                 " values per voxel; one is needed");
  }
  if (array->GetNumberOfTuples() != image.GetNumberOfPoints()) {
    throw BadDataError(path, "truncated: " + std::to_string(array->GetNumberOfTuples()) +
                                 " values for " + std::to_string(image.GetNumberOfPoints()) +
                                 " voxels");
  }
  return *array;
}

Shear place(vtkImageData& image, Volume& volume, const std::string& name) {
  int extent[6];
  image.GetExtent(extent);
  std::array<std::int64_t, 3> size;
  Eigen::Matrix3d axes;
  Eigen::Vector3d first, origin;
  for (int axis = 0; axis < 3; ++axis) {
    size[axis] = std::int64_t{extent[2 * axis + 1]} - extent[2 * axis] + 1;
    for (int row = 0; row < 3; ++row) {
      axes(row, axis) =
          image.GetDirectionMatrix()->GetElement(row, axis) * image.GetSpacing()[axis];
    }
    first[axis] = extent[2 * axis];
    origin[axis] = image.GetOrigin()[axis];
  }
  checked_voxel_count(size, name);
  for (int axis = 0; axis < 3; ++axis) volume.size[axis] = static_cast<int>(size[axis]);
  // VTK's origin is where index 0 would lie, even when the extent begins elsewhere.
  return set_grid_or_shear(volume, axes, origin + axes * first, name);
}

}  // namespace

Volume read_vti(const std::filesystem::path& path, const VolumeReadOptions& options) {
  vtkNew<vtkXMLImageDataReader> reader;
  VtkErrorLog errors;
  errors.watch(reader);
  reader->SetParserErrorObserver(errors.observer());
  reader->SetFileName(path.c_str());
  reader->Update();
  errors.throw_if_any(path);
  vtkImageData& image = *reader->GetOutput();
  if (image.GetNumberOfPoints() == 0) throw BadDataError(path, "holds no voxels");
  Volume volume;
  const Shear shear = place(image, volume, path.string());
  vtkDataArray& scalars = scalars_of(image, path);
  const VoxelEncoding encoding{type_of(scalars, path), false, 1, 0};
  const auto count = static_cast<std::size_t>(scalars.GetNumberOfTuples());
  volume.voxels.resize(count);
  ConversionLoss loss;
  convert_voxels(static_cast<const std::byte*>(scalars.GetVoidPointer(0)), count, encoding, volume,
                 0, loss);
  settle_losses(loss, volume, path.string());
  if (shear) return straightened(std::move(volume), shear, options, path.string());
  if (!options.region) return volume;
  const IndexBox box = voxels_of_region(volume, *options.region, path.string());
  return cropped(std::move(volume), box);
}

}  // namespace organbake
