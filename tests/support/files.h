// SPDX-License-Identifier: GPL-3.0-or-later
// Scans and meshes as other programs write them, byte by byte.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/geometry/triangle_mesh.h"
#include "organbake/volume/volume.h"
#include "support/error_message.h"
#include "support/places.h"

namespace organbake {

// A value for every place in the world that no mirroring, turning or shifting maps onto itself: a
// reader that gets one axis wrong gives nearly every voxel a wrong value.
double ramp_hu(const Eigen::Vector3d& world_mm);

// A rotation about all three axes.
Eigen::Matrix3d oblique_direction();

// The ramp sampled on a grid of 5×4×3 voxels of 0.8×1.25×3 mm.
Volume ramp_volume(const Eigen::Matrix3d& direction = Eigen::Matrix3d::Identity(),
                   const Eigen::Vector3d& origin_mm = {-40, 25, 110});

// How far the voxels of a volume are from the ramp at their own places, in HU.
double largest_ramp_error(const Volume& volume);

// Calls take(i, j, k) for every voxel of a grid, in the order in which they are stored.
template <typename Take>
void for_each_voxel(const std::array<int, 3>& size, const Take& take) {
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) take(i, j, k);
}

void write_bytes(const std::filesystem::path& path, const std::string& bytes);
std::string read_bytes(const std::filesystem::path& path);
std::string gzipped(const std::string& bytes);
// The voxels as little-endian int16.
std::string voxel_bytes(const Volume& volume);

// The DICOM abdomen, decoded once for all tests (JPEG 2000 takes its time).
const Volume& dicom_abdomen();

// Skips a test, loudly, where the real data is not there.
#define REQUIRE_SHARED_DATA(below)                                            \
  if (!std::filesystem::exists(::organbake::shared_data(below))) {            \
    GTEST_SKIP() << "REAL DATA MISSING: " << ::organbake::shared_data(below); \
  }

// A NIfTI-1 file in the making; the constructor fills it from a volume (LPS), whose affine goes to
// the sform in RAS. Tests then spoil single fields.
struct NiftiBytes {
  explicit NiftiBytes(const Volume& volume);

  std::vector<std::int16_t> dim = {3, 1, 1, 1, 1, 1, 1, 1};
  std::int16_t datatype = 4;
  std::vector<float> pixdim = {1, 1, 1, 1, 0, 0, 0, 0};
  float vox_offset = 352;
  float slope = 1, intercept = 0;
  std::uint8_t units = 2;
  std::int16_t qform_code = 0, sform_code = 1;
  float quaternion[6] = {0, 0, 0, 0, 0, 0};  // b, c, d and the offset
  float sform[12] = {};
  std::string magic = std::string("n+1\0", 4);
  std::int32_t sizeof_hdr = 348;
  bool big_endian = false;
  std::string voxels;  // as stored

  // Writes a direction and an origin (LPS) as a qform; left-handed ones take qfac −1.
  void set_qform(const Volume& volume);
  std::string bytes() const;
  // The same as NIfTI-2.
  std::string bytes_nifti2() const;
  // Makes a mask of labels 5, liver, and 11, gall bladder, in turns, whose names stand in an
  // extension as TotalSegmentator writes it. Little-endian alone.
  void set_named_labels();
  // The stored int16 voxels, too.
  void swap_to_big_endian();
};

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

// A mesh as other programs write it, in the formats that the project reads and does not write.
std::string as_obj(const TriangleMesh& mesh);
std::string as_off(const TriangleMesh& mesh);
std::string as_vtk(const TriangleMesh& mesh, const std::string& more = {});
// As VTK 9 does: version 5.1, big-endian, offsets and corners apart, a field and metadata.
std::string as_binary_vtk(const TriangleMesh& mesh);
std::string as_binary_stl(const TriangleMesh& mesh);
std::string as_ascii_stl(const TriangleMesh& mesh);
std::string as_vtp(const TriangleMesh& mesh);
// An unstructured grid of cells of one kind: 5 triangles, 9 quads, 10 tetrahedra, 12 hexahedra.
std::string as_vtu(const std::vector<Eigen::Vector3d>& points,
                   const std::vector<std::vector<std::uint32_t>>& cells, int kind);
std::vector<std::vector<std::uint32_t>> triangles_of(const TriangleMesh& mesh);
// Binary glTF in metres; `node` is more of the only node's JSON.
std::string as_glb(const TriangleMesh& mesh, const std::string& node = {});

}  // namespace organbake
