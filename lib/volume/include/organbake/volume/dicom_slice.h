// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace organbake {

// How and where a DICOM image stores its pixels.
struct DicomPixels {
  static constexpr std::uint32_t kEncapsulated = 0xFFFFFFFF;

  std::string transfer_syntax;
  std::string photometric;
  int bits_allocated = 16, bits_stored = 16;
  bool is_signed = false;
  int samples = 1, frames = 1;
  bool present = false;      // the file has pixel data
  std::uint64_t offset = 0;  // of their first byte in the file
  std::uint32_t bytes = 0;   // kEncapsulated when they are compressed
  struct Padding {
    int first, last;  // stored values that mean "not measured"
  };
  std::optional<Padding> padding;
  bool big_endian = false;
};

// What the header of one DICOM image, or of one frame of several, says, as far as a CT volume needs
// it.
struct DicomSlice {
  std::filesystem::path file;
  int frame = 0;  // of pixels.frames, from 0
  std::string series_uid, series_number, series_description;
  std::string frame_of_reference_uid;  // of the space that the places are in
  std::string acquisition;             // number of the acquisition within the series
  std::string modality;
  bool is_localizer = false;
  int columns = 0, rows = 0;
  bool has_geometry = false;  // ImagePositionPatient, ImageOrientationPatient and PixelSpacing
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();  // centre of the first pixel, LPS
  Eigen::Vector3d row_axis = Eigen::Vector3d::UnitX();    // along which the column index grows
  Eigen::Vector3d column_axis = Eigen::Vector3d::UnitY();
  Eigen::Vector2d pixel_mm = Eigen::Vector2d::Ones();  // along row_axis, along column_axis
  double slope = 1, intercept = 0;
  // What may tell several volumes of the same places apart, the most telling first:
  // {"temporal position", "3"}. Only what the header has.
  std::vector<std::pair<std::string, std::string>> told_apart_by;
  DicomPixels pixels;

  // The value of one of these; empty where the header has none.
  std::string told_by(const std::string& what) const {
    for (const auto& [name, value] : told_apart_by)
      if (name == what) return value;
    return {};
  }
  // What the stored values of the slice take, uncompressed.
  std::size_t stored_bytes() const {
    return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) *
           static_cast<std::size_t>(pixels.bits_allocated / 8);
  }
  Eigen::Vector3d normal() const { return row_axis.cross(column_axis); }
  // Columns: along a row, along a column, the unit normal.
  Eigen::Matrix3d plane_axes() const {
    Eigen::Matrix3d axes;
    axes << row_axis, column_axis, normal().normalized();
    return axes;
  }
};

// What one file turned out to be: an image, or why it is none.
struct ScannedFile {
  std::filesystem::path file;
  std::optional<DicomSlice> slice;       // of several frames the first
  std::vector<DicomSlice> later_frames;  // of an image of several, each with its own place
  bool is_dicom = false;                 // by its first bytes
  bool damaged = false;
  std::string reason;  // why a DICOM file is no image
};

// Reads one file's header with vtk-dicom's parser. Throws nothing for what is in the file.
ScannedFile scan_dicom_file(const std::filesystem::path& file);

}  // namespace organbake
