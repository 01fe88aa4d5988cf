// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace organbake {

// One CT slice as an uncompressed DICOM file (explicit little-endian), 4×3 pixels unless changed.
struct DicomBytes {
  std::string modality = "CT";
  std::string series_uid = "1.2.3", series_number = "7";
  std::string image_type, acquisition;  // empty = the tag is left out
  int padding = -1;                     // stored value; −1 = the tag is left out
  std::string transfer_syntax = "1.2.840.10008.1.2.1";
  std::string photometric = "MONOCHROME2";
  std::string position = "0\\0\\0";  // empty = the tag is left out
  std::string orientation = "1\\0\\0\\0\\1\\0";
  std::string pixel_spacing = "0.5\\0.75";  // between rows, between columns
  std::string slope = "1", intercept = "-1024";
  std::uint16_t rows = 3, columns = 4;
  bool is_signed = false;
  std::vector<std::uint16_t> pixels;

  void set_position(const Eigen::Vector3d& position_mm);
  std::string bytes() const;
};

}  // namespace organbake
