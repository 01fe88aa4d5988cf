// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "volume/dicom_slice.h"

namespace organbake {

// Parallel slices of one series in the order of their positions along the normal.
struct DicomStack {
  std::vector<DicomSlice> slices;
  std::vector<double> along_mm;           // position of each slice along the normal, increasing
  std::vector<Eigen::Vector2d> drift_px;  // in-plane offset to the first slice (columns, rows)
  double spacing_mm = 0;  // of the regular grid: the mean gap, or the median if uneven
  bool even = true;
  double tilt_degrees = 0;  // between the stack's course and the normal; 0 = upright
  std::vector<std::string> warnings;

  bool regular() const { return even && tilt_degrees == 0; }
};

// Picks the CT series with most slices (equal orientation, size and pixel spacing) and sorts it.
// Throws BadDataError when there is no CT, a slice has no geometry, two slices lie in one place, or
// slices are missing.
DicomStack choose_stack(DicomFolder folder, const std::filesystem::path& path);

}  // namespace organbake
