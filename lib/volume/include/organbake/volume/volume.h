// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "organbake/volume/zeroed_pages.h"

namespace organbake {

// What a mask calls one of its labels.
struct LabelName {
  int label = 0;
  std::string name;
  int layer = 0;  // of files whose segments may overlap; each layer has labels of its own
  std::vector<int> with = {};  // further labels of the same name: a region of several
};
// The largest number of a label: up to here float32 holds every whole number.
inline constexpr int kMostLabel = 1 << 24;

// The slices of a DICOM series as they were scanned, all of them, whatever part of it was read.
struct ScannedSlices {
  std::string series_uid, frame_of_reference_uid;
  std::vector<Eigen::Vector3d> corners_mm;  // centre of each one's first pixel, by place
};

// A CT in Hounsfield units, a volume of any other numbers, or a label mask, on a regular grid.
// world = LPS millimetres:
//   x_world = origin_mm + direction · (spacing_mm ∘ index),  index of a voxel's centre.
struct Volume {
  std::array<int, 3> size{};  // x fastest
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Ones();
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  // Columns: unit axes of i, j, k. Voxels stay in the file's order, so a left-handed file gives an
  // improper direction (determinant −1); whoever turns the grid into faces must look at its sign.
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();
  // The values stand in one of two, the other is empty: all of them whole numbers of 16 bits, as
  // nearly every CT and mask has them, or float32, where a single one is not. A NaN was not
  // measured and lies outside of whatever is looked for.
  std::vector<std::int16_t, ZeroedPages<std::int16_t>> voxels;
  std::vector<float> reals;
  double gantry_tilt_degrees = 0;      // of the scan, taken out by the reader
  ScannedSlices slices;                // of a DICOM series
  std::vector<LabelName> label_names;  // of a mask, where its file has them
  int chosen_label = 0;                // of a mask, by the options of reading it; 0 = none
  std::string chosen_name;             // "liver", "label 5 and label 7"
  bool ends_with_label = false;        // of a mask whose grid was made round its labels
  std::int64_t time_points = 1;        // that the file holds; this is one of them
  std::vector<std::string> warnings;   // what the reader had to mend or wants to be known

  bool is_real() const { return !reals.empty(); }
  std::size_t voxel_count() const { return is_real() ? reals.size() : voxels.size(); }
  Eigen::Vector3d world_from_index(const Eigen::Vector3d& index) const {
    return origin_mm + direction * spacing_mm.cwiseProduct(index);
  }
  Eigen::Vector3d index_from_world(const Eigen::Vector3d& world) const {
    return (direction.transpose() * (world - origin_mm)).cwiseQuotient(spacing_mm);
  }
  double at(int i, int j, int k) const {
    const std::size_t voxel = (std::size_t(k) * size[1] + j) * size[0] + i;
    return is_real() ? reals[voxel] : voxels[voxel];
  }
};

// Calls use(values) with a span of the kind of numbers that the volume holds.
template <class Use>
decltype(auto) with_values(const Volume& volume, Use&& use) {
  if (volume.is_real()) return use(std::span<const float>(volume.reals));
  return use(std::span<const std::int16_t>(volume.voxels));
}
template <class Use>
decltype(auto) with_values(Volume& volume, Use&& use) {
  if (volume.is_real()) return use(std::span<float>(volume.reals));
  return use(std::span<std::int16_t>(volume.voxels));
}
// Sets all values, x fastest: as whole numbers where they all are. Throws BadDataError when all are
// NaN.
void set_values(Volume& volume, std::span<const double> values);
// One value between others: rounded where the volume's are whole numbers.
inline void set_value(Volume& volume, std::size_t voxel, double value) {
  if (volume.is_real()) {
    volume.reals[voxel] = static_cast<float>(value);
  } else {
    volume.voxels[voxel] = static_cast<std::int16_t>(std::lround(value));
  }
}
// Makes the values float32, whatever they are.
void make_real(Volume& volume);
// Makes them labels: whole numbers, background where a value is NaN. What that changed goes into
// the warnings.
void make_labels(Volume& volume);

struct ValueRange {
  double min = 0, max = 0;  // of the values that are numbers
  bool has_nan = false;
};
ValueRange value_range(const Volume& volume);

struct LabelCount {
  int label = 0;
  std::size_t voxels = 0;
};
// The labels of a mask in increasing order, without the background 0.
std::vector<LabelCount> count_labels(const Volume& volume);

// From slice to slice of a DICOM series as it was scanned, along the normal.
std::vector<double> slice_gaps_mm(const Volume& volume);

// Whether voxel (i, j, k) of both lies at the same place, to 1 % of a voxel.
bool same_grid(const Volume& a, const Volume& b);

// Throws BadDataError: sizes, spacing > 0, orthonormal direction, voxel count.
void check_volume(const Volume& volume, const std::string& name);

}  // namespace organbake
