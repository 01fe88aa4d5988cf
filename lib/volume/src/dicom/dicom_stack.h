// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "grid/planes.h"
#include "organbake/volume/dicom_slice.h"
#include "organbake/volume/read_options.h"

namespace organbake {

// Parallel slices of one series in the order of their positions along the normal. Nothing but
// ImagePositionPatient and ImageOrientationPatient counts: file names, instance numbers,
// SliceThickness and SpacingBetweenSlices are often wrong.
struct DicomStack {
  std::vector<DicomSlice> slices;
  PlaneStack planes;      // theirs, along_mm increasing
  double spacing_mm = 0;  // of the regular grid: the mean gap, or the median if uneven
  bool even = true;
  double tilt_degrees = 0;       // between the stack's course and the normal; 0 = upright
  std::int64_t time_points = 1;  // volumes of the same places that the series holds; this is one
  std::vector<std::string> warnings;

  bool regular() const { return even && tilt_degrees == 0; }
};

// Sorts the slices of one series (equal orientation, size and pixel spacing; at least two), drops
// copies, takes the one of several volumes of the same places that options.time says, and measures
// gaps and tilt. What had to be mended is told in `warnings`. With options.strict,
// uneven gaps, missing and repeated slices are refused instead. Throws BadDataError also when all
// slices lie in one place, two that differ lie in the same one, or a gap is too wide to fill.
DicomStack sorted_stack(std::vector<DicomSlice> slices, const std::filesystem::path& folder,
                        const VolumeReadOptions& options);

}  // namespace organbake
