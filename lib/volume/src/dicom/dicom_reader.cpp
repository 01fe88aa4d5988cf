// SPDX-License-Identifier: GPL-3.0-or-later
#include "dicom/dicom_reader.h"

#include <algorithm>
#include <span>

#include "dicom/dicom_pixels.h"
#include "dicom/dicom_stack.h"
#include "grid/affine_grid.h"
#include "grid/planes.h"
#include "organbake/core/error.h"
#include "organbake/volume/dicom_series.h"

namespace organbake {
namespace {

namespace fs = std::filesystem;

// Resampled at a time: the decoded slices of a few are all that is held beside the volume.
constexpr int kSlicesAtATime = 16;

// The grid of the stack as it was scanned, by its first slice.
Volume scanned_grid(const DicomStack& stack, const fs::path& folder) {
  const DicomSlice& first = stack.slices.front();
  Volume grid;
  grid.size = {first.columns, first.rows, static_cast<int>(stack.slices.size())};
  checked_voxel_count({grid.size[0], grid.size[1], grid.size[2]}, folder.string());
  Eigen::Matrix3d axes;
  axes << first.row_axis * first.pixel_mm.x(), first.column_axis * first.pixel_mm.y(),
      first.normal() * stack.spacing_mm;
  set_grid(grid, axes, first.position_mm, folder.string());
  return grid;
}

void resample(const DicomStack& stack, const Volume& scanned, const IndexBox& box, Volume& volume,
              const RunContext& context) {
  volume.voxels.resize(box.voxels());
  const IndexBox whole_slices = {{0, 0, 0}, {scanned.size[0], scanned.size[1], 1}};
  for (int k = 0; k < box.size[2]; k += kSlicesAtATime) {
    const int count = std::min(kSlicesAtATime, box.size[2] - k);
    const PlaneRange range =
        planes_needed(stack.planes, stack.spacing_mm, box.first[2] + k, box.first[2] + k + count);
    Volume decoded;
    decoded.size = {scanned.size[0], scanned.size[1], range.count()};
    decode_slices(std::span(stack.slices)
                      .subspan(static_cast<std::size_t>(range.first),
                               static_cast<std::size_t>(range.count())),
                  whole_slices, decoded, context, volume.is_real());
    if (decoded.is_real()) make_real(volume);
    resample_planes(stack.planes, stack.spacing_mm, decoded, range, box, k, count, volume);
    // Pieces repeat each other's complaints.
    for (const std::string& warning : decoded.warnings) {
      const auto& told = volume.warnings;
      if (std::find(told.begin(), told.end(), warning) == told.end()) {
        volume.warnings.push_back(warning);
      }
    }
    context.progress(static_cast<double>(k + count) / box.size[2]);
  }
}

DicomStack stack_of(const fs::path& folder, const VolumeReadOptions& options) {
  const DicomFolder found =
      fs::is_directory(folder) ? scan_dicom_folder(folder) : scan_dicom_file_or_directory(folder);
  std::vector<std::string> warnings;
  DicomSeries series = choose_series(found, options.series, warnings);
  if (options.strict) {
    for (const ScannedFile& other : found.others) {
      if (!other.damaged) continue;
      throw BadDataError(other.file,
                         "--strict refuses a folder with damaged files: " + other.reason);
    }
  }
  DicomStack stack = sorted_stack(std::move(series.slices), folder, options);
  stack.warnings.insert(stack.warnings.begin(), warnings.begin(), warnings.end());
  return stack;
}

}  // namespace

Volume read_dicom(const fs::path& folder, const VolumeReadOptions& options,
                  const RunContext& context) {
  const DicomStack stack = stack_of(folder, options);
  const Volume scanned = scanned_grid(stack, folder);
  Volume volume = stack.regular()
                      ? scanned
                      : upright_grid(stack.planes, scanned, stack.spacing_mm, folder.string());
  volume.warnings = stack.warnings;
  volume.time_points = stack.time_points;
  volume.gantry_tilt_degrees = stack.tilt_degrees;
  volume.slices = {stack.slices.front().series_uid, stack.slices.front().frame_of_reference_uid,
                   stack.planes.corners_mm};
  const IndexBox box = options.region ? voxels_of_region(volume, *options.region, folder.string())
                                      : IndexBox::whole(volume);
  crop_grid(volume, box);
  if (stack.regular()) {
    decode_slices(
        std::span(stack.slices)
            .subspan(static_cast<std::size_t>(box.first[2]), static_cast<std::size_t>(box.size[2])),
        box, volume, context);
  } else {
    resample(stack, scanned, box, volume, context);
  }
  return volume;
}

}  // namespace organbake
