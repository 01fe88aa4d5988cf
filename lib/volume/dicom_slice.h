// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

namespace organbake {

// What the header of one DICOM image says, as far as a CT volume needs it.
struct DicomSlice {
  std::filesystem::path file;
  std::string series_uid;
  std::string series_number;
  std::string modality;
  std::string transfer_syntax;
  std::string photometric;
  int columns = 0, rows = 0;
  int frames = 1;
  bool has_geometry = false;  // ImagePositionPatient, ImageOrientationPatient and PixelSpacing
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  // centre of the first pixel, LPS
  Eigen::Vector3d row_axis = Eigen::Vector3d::UnitX();    // along which the column index grows
  Eigen::Vector3d column_axis = Eigen::Vector3d::UnitY();
  Eigen::Vector2d pixel_mm = Eigen::Vector2d::Ones();  // along row_axis, along column_axis
  double slope = 1, intercept = 0;

  Eigen::Vector3d normal() const { return row_axis.cross(column_axis); }
};

struct DicomFolder {
  std::vector<DicomSlice> slices;  // in byte order of the file names
  std::size_t unreadable = 0;      // DICOM by their first bytes, but damaged
  std::string first_error;
};

// Reads the headers of all images in a folder. Throws NoInputError when it is empty or holds no
// DICOM image, BadDataError when none of its DICOM files can be read.
DicomFolder scan_dicom_folder(const std::filesystem::path& folder);

}  // namespace organbake
