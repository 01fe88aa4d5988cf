// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace organbake {

// `bytes` of memory that hold zeros. Pages that are not written take no room. Throws
// std::bad_alloc.
void* allocate_zeroed(std::size_t bytes);
void free_zeroed(void* memory, std::size_t bytes) noexcept;

// An allocator for the voxels of a volume. The system hands out zeros, so new values are not
// written once more: the background of a mask, most of its voxels, takes neither time nor room. A
// vector that shrank and grows again finds its old values there.
template <class Value>
struct ZeroedPages {
  using value_type = Value;

  ZeroedPages() = default;
  template <class Other>
  ZeroedPages(const ZeroedPages<Other>&) noexcept {}  // implicit, as allocators have to be

  Value* allocate(std::size_t count) {
    if (count > static_cast<std::size_t>(-1) / sizeof(Value)) throw std::bad_array_new_length();
    return static_cast<Value*>(allocate_zeroed(count * sizeof(Value)));
  }
  void deallocate(Value* values, std::size_t count) noexcept {
    free_zeroed(values, count * sizeof(Value));
  }
  void construct(Value*) const noexcept {}  // 0 already
  template <class From>
  void construct(Value* at, From&& from) const {
    ::new (static_cast<void*>(at)) Value(std::forward<From>(from));
  }
  friend bool operator==(const ZeroedPages&, const ZeroedPages&) { return true; }
};

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
  std::string frame_of_reference_uid;
  std::vector<Eigen::Vector3d> corners_mm;  // centre of each one's first pixel, by place
  int columns = 0, rows = 0;                // pixels of each
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

// A box of the world, LPS millimetres, along the patient's axes.
struct Region {
  Eigen::Vector3d min_mm = Eigen::Vector3d::Zero(), max_mm = Eigen::Vector3d::Zero();
};

// "x0,y0,z0,x1,y1,z1": two opposite corners in any order. Throws UsageError naming `where`.
Region parse_region(const std::string& text, const std::string& where);

// A box of voxels.
struct IndexBox {
  std::array<int, 3> first{}, size{};

  static IndexBox whole(const Volume& grid) { return {{0, 0, 0}, grid.size}; }
  bool is_whole(const Volume& grid) const { return size == grid.size; }
  std::size_t voxels() const { return static_cast<std::size_t>(size[0]) * size[1] * size[2]; }
};

// The smallest box of voxels that holds all of the region that lies in the grid, and one voxel
// around it, so that a surface inside is the same with and without cropping. Only the grid's size
// and place count, not its voxels. None where the region misses the grid.
std::optional<IndexBox> voxels_within(const Volume& grid, const Region& region);
// The same; throws BadDataError when the region misses the grid.
IndexBox voxels_of_region(const Volume& grid, const Region& region, const std::string& name);

// Makes the grid (size and origin) that of the box; the voxels are left alone.
void crop_grid(Volume& grid, const IndexBox& box);

// The box's part of a whole volume.
Volume cropped(Volume volume, const IndexBox& box);

// The figures of a volume that `inspect` prints.
struct VolumeFigures {
  std::array<int, 3> size{};
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d extent_mm = Eigen::Vector3d::Zero();  // size ∘ spacing
  Eigen::Vector3d min_mm = Eigen::Vector3d::Zero();     // of the voxel centres, LPS
  Eigen::Vector3d max_mm = Eigen::Vector3d::Zero();
  // The patient's side that each index axis runs towards: "LPS" for a plain axial CT, "LAS" for
  // one with its rows from posterior to anterior. (ITK names the sides it comes from: "RAI".)
  std::string orientation;
  double oblique_degrees = 0;  // largest angle between an index axis and a patient axis
  bool left_handed = false;
  ValueRange range;
};

VolumeFigures volume_figures(const Volume& volume);

// "-149.5, -61.5, -842.5 … 249.5, …": the box of the voxel centres in world millimetres.
std::string world_range_text(const Volume& volume);

}  // namespace organbake
