// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "organbake/volume/volume.h"

namespace organbake {

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
