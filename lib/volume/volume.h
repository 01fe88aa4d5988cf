// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace organbake {

// What a mask calls one of its labels.
struct LabelName {
  int label = 0;
  std::string name;
  int layer = 0;  // of files whose segments may overlap; each layer has labels of its own
};

// A CT in Hounsfield units, or a label mask, on a regular grid. world = LPS millimetres:
//   x_world = origin_mm + direction · (spacing_mm ∘ index),  index of a voxel's centre.
struct Volume {
  std::array<int, 3> size{};  // x fastest
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Ones();
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  // Columns: unit axes of i, j, k. Voxels stay in the file's order, so a left-handed file gives an
  // improper direction (determinant −1); whoever turns the grid into faces must look at its sign.
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();
  std::vector<std::int16_t> voxels;
  double gantry_tilt_degrees = 0;      // of the scan, taken out by the reader
  std::vector<double> slice_gaps_mm;   // of a DICOM series as scanned, along the normal
  std::vector<LabelName> label_names;  // of a mask, where its file has them
  int chosen_label = 0;                // of a mask, by the options of reading it; 0 = none
  std::string chosen_name;             // "liver", "label 5 and label 7"
  std::int64_t time_points = 1;        // that the file holds; this is one of them
  std::vector<std::string> warnings;   // what the reader had to mend or wants to be known

  std::size_t voxel_count() const { return voxels.size(); }
  Eigen::Vector3d world_from_index(const Eigen::Vector3d& index) const {
    return origin_mm + direction * spacing_mm.cwiseProduct(index);
  }
  Eigen::Vector3d index_from_world(const Eigen::Vector3d& world) const {
    return (direction.transpose() * (world - origin_mm)).cwiseQuotient(spacing_mm);
  }
  std::int16_t at(int i, int j, int k) const {
    return voxels[(std::size_t(k) * size[1] + j) * size[0] + i];
  }
};

struct ValueRange {
  int min = 0, max = 0;
};
ValueRange value_range(const Volume& volume);

struct LabelCount {
  int label = 0;
  std::size_t voxels = 0;
};
// The labels of a mask in increasing order, without the background 0.
std::vector<LabelCount> count_labels(const Volume& volume);

// Whether voxel (i, j, k) of both lies at the same place, to 1 % of a voxel.
bool same_grid(const Volume& a, const Volume& b);

// Throws BadDataError: sizes, spacing > 0, orthonormal direction, voxel count.
void check_volume(const Volume& volume, const std::string& name);

}  // namespace organbake
