// SPDX-License-Identifier: GPL-3.0-or-later
#include "volume/dicom_reader.h"

#include "volume/dicom_pixels.h"
#include "volume/dicom_stack.h"
#include "volume/grid.h"
#include "volume/slice_resampling.h"

namespace organbake {

Volume read_dicom_folder(const std::filesystem::path& folder, const RunContext& context) {
  const DicomStack stack = choose_stack(scan_dicom_folder(folder), folder);
  const DicomSlice& first = stack.slices.front();
  Volume volume;
  volume.warnings = stack.warnings;
  volume.size = {first.columns, first.rows, static_cast<int>(stack.slices.size())};
  checked_voxel_count({volume.size[0], volume.size[1], volume.size[2]}, folder.string());
  Eigen::Matrix3d axes;
  axes << first.row_axis * first.pixel_mm.x(), first.column_axis * first.pixel_mm.y(),
      first.normal() * stack.spacing_mm;
  set_grid(volume, axes, first.position_mm, folder.string());
  decode_stack(stack, volume, context);
  return stack.regular() ? volume : resample_stack(stack, volume);
}

}  // namespace organbake
