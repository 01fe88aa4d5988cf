// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace organbake {

// One data element in explicit little-endian, its value padded to even length.
std::string dicom_element(std::uint16_t group, std::uint16_t number, const std::string& vr,
                          const std::string& value);
// A sequence of items, each the text of its elements.
std::string dicom_sequence(std::uint16_t group, std::uint16_t number,
                           const std::vector<std::string>& items);
std::string dicom_number(std::uint32_t value, int bytes);  // little-endian
// Preamble and meta group of a file of a class.
std::string dicom_head(const std::string& sop_class,
                       const std::string& transfer_syntax = "1.2.840.10008.1.2.1");

// One CT slice as an uncompressed DICOM file (explicit little-endian), 4×3 pixels unless changed.
struct DicomBytes {
  std::string modality = "CT";
  std::string series_uid = "1.2.3", series_number = "7";
  std::string frame_of_reference;         // empty = the tag is left out
  std::string image_type, acquisition;    // empty = the tag is left out
  std::string kernel, temporal_position;  // the same
  int padding = -1;                       // stored value; −1 = the tag is left out
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

// The same slices as one file of several frames, an Enhanced CT (PS3.3, A.38).
std::string enhanced_ct(const std::vector<DicomBytes>& slices);

// A segmentation of "liver" and "cyst, large" as a DICOM file. Frames of 7×5 pixels unless told, so
// that a frame's 35 bits end in the middle of a byte.
struct SegBytes {
  struct Frame {
    int segment;
    double z;
    std::vector<int> values;                     // rows × columns
    std::optional<Eigen::Vector3d> corner = {};  // in place of (10, -20, z)
    std::string phase = {};                      // temporal position index
    std::string orientation = {};                // of its own; empty = that of all
    std::string pixel_spacing = {};
  };
  std::string kind = "BINARY";
  int bits = 1;
  std::vector<Frame> frames;
  bool rle = false;
  int columns = 7, rows = 5;
  std::string orientation = "1\\0\\0\\0\\1\\0", pixel_spacing = "0.5\\0.75";
  std::string gap = {}, thickness = {};  // SpacingBetweenSlices, SliceThickness; empty = not told
  std::string frame_of_reference = {};

  std::string bytes() const;

  // Each frame's bytes as one segment (PS3.5, G): a run of zeros, then literals.
  std::string run_lengths() const;
};

// One region of interest of closed contours, each x, y of a plane.
struct Roi {
  std::string name;
  std::vector<std::pair<double, std::vector<Eigen::Vector2d>>> contours;
  std::string frame_of_reference = {};
  std::string slab = {};  // ContourSlabThickness, mm
};

// An RTSTRUCT of them.
std::string structure_set(const std::vector<Roi>& regions,
                          const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity());

}  // namespace organbake
