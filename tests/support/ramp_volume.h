// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "organbake/core/error.h"
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

}  // namespace organbake
