// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>

#include "files/byte_stream.h"
#include "files/voxel_decoding.h"

namespace organbake {

// How voxels lie in the world, millimetres (RAS): columns of axes per index, place of index 0.
struct NiftiAffine {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
};

// What the header of a NIfTI-1 or NIfTI-2 file says, of either byte order and either layout.
// Sources: nifti1.h (Cox et al. 2004), nifti2.h (2011).
struct NiftiHeader {
  // Reads it off the front of a stream. Throws BadDataError: no NIfTI, Analyze, too short.
  explicit NiftiHeader(ByteStream& stream);

  std::string name;  // of the file, for errors
  bool big_endian = false;
  bool voxels_apart = false;  // in an .img beside the header
  std::uint64_t header_bytes = 0;
  double data_offset = 0;             // of the voxels in their file
  std::array<std::int64_t, 8> dim{};  // how many dimensions, then their sizes
  std::array<double, 8> pixdim{};     // handedness of the qform, then voxel sizes
  int datatype = 0;
  double slope = 0, intercept = 0;
  int qform_code = 0, sform_code = 0;
  int units = 0;  // of space in the lowest three bits, of time in the next three
  std::array<double, 6> quaternion{};  // b, c, d, then the offset
  std::array<double, 12> srow{};       // rows of the sform's 3×4 matrix

  std::int64_t time_points() const;  // volumes one after another; 1 = a plain one
  std::string time_step() const;     // "every 0.5 s", or nothing
  VoxelEncoding encoding() const;
  double millimetres_per_unit() const;
  NiftiAffine sform() const;
  NiftiAffine qform() const;
};

}  // namespace organbake
