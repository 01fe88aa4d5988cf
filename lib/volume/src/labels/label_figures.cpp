// SPDX-License-Identifier: GPL-3.0-or-later
// How much of a mask each label takes, and the box that it lies in.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <type_traits>
#include <vector>

#include "grid/grids.h"
#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/volume/labels.h"

namespace organbake {
namespace {

struct LabelBounds {
  std::size_t voxels = 0;
  Eigen::Vector3i low, high;

  void add(const Eigen::Vector3i& first, const Eigen::Vector3i& last) {
    low = voxels == 0 ? first : low.cwiseMin(first);
    high = voxels == 0 ? last : high.cwiseMax(last);
    voxels += static_cast<std::size_t>(last.x() - first.x() + 1);
  }
};

// By runs along a row: a mask has few of them, whatever its size.
std::map<int, LabelBounds> bounds_by_label(const Volume& mask) {
  std::map<int, LabelBounds> found;
  with_values(mask, [&](const auto values) {
    auto row = values.data();
    for (int k = 0; k < mask.size[2]; ++k) {
      for (int j = 0; j < mask.size[1]; ++j, row += mask.size[0]) {
        for (int i = 0; i < mask.size[0];) {
          int end = i + 1;
          while (end < mask.size[0] && row[end] == row[i]) ++end;
          const bool label = std::isfinite(static_cast<float>(row[i])) && row[i] != 0;
          if (label) found[static_cast<int>(row[i])].add({i, j, k}, {end - 1, j, k});
          i = end;
        }
      }
    }
  });
  return found;
}

// Of the world, round the voxels between two indices.
Region world_box(const Volume& grid, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  Region box = {Eigen::Vector3d::Constant(1e30), Eigen::Vector3d::Constant(-1e30)};
  for (const Eigen::Vector3d& index : corners_of(low, high)) {
    box.min_mm = box.min_mm.cwiseMin(grid.world_from_index(index));
    box.max_mm = box.max_mm.cwiseMax(grid.world_from_index(index));
  }
  return box;
}

std::string point(const Eigen::Vector3d& p) {
  return "(" + to_text(p.x(), 1) + ", " + to_text(p.y(), 1) + ", " + to_text(p.z(), 1) + ")";
}

}  // namespace

bool looks_like_mask(const Volume& volume) {
  constexpr int kMostLabels = 1000;  // HU spread over thousands, and below 0
  if (!volume.label_names.empty()) return true;
  const ValueRange range = value_range(volume);
  const auto no_label = [](float value) { return value != std::floor(value); };
  return range.min >= 0 && range.max <= kMostLabels &&
         std::none_of(volume.reals.begin(), volume.reals.end(),
                      [&](float value) { return !std::isnan(value) && no_label(value); });
}

std::vector<LabelFigures> label_figures(const Volume& mask) {
  std::vector<LabelFigures> all;
  const double voxel_ml = mask.spacing_mm.prod() / 1000;
  for (const auto& [label, bounds] : bounds_by_label(mask)) {
    LabelFigures figures;
    figures.label = label;
    for (const LabelName& known : mask.label_names)
      if (known.label == label) figures.name = known.name;
    figures.voxels = bounds.voxels;
    figures.volume_ml = static_cast<double>(bounds.voxels) * voxel_ml;
    const Region box = world_box(mask, bounds.low.cast<double>(), bounds.high.cast<double>());
    figures.min_mm = box.min_mm;
    figures.max_mm = box.max_mm;
    all.push_back(figures);
  }
  return all;
}

std::string label_line(const LabelFigures& figures) {
  return std::to_string(figures.label) + (figures.name.empty() ? "" : " " + figures.name) + ": " +
         to_text(figures.volume_ml, 1) + " ml, " + std::to_string(figures.voxels) + " voxels, " +
         point(figures.min_mm) + "…" + point(figures.max_mm) + " mm";
}

namespace {

struct SliceBox {
  std::size_t label_voxels = 0;
  std::array<int, 2> low = {std::numeric_limits<int>::max(), std::numeric_limits<int>::max()};
  std::array<int, 2> high = {-1, -1};

  void add(int axis, int first, int last) {
    low[axis] = std::min(low[axis], first);
    high[axis] = std::max(high[axis], last);
  }
};

// A counter as wide as the values lets many be compared at once; so many at most does it hold.
template <class Value>
std::size_t count_in_row(std::span<Value> row, std::remove_const_t<Value> label) {
  using Counter = std::conditional_t<sizeof(Value) == 2, std::uint16_t, std::uint32_t>;
  constexpr std::size_t kMost = std::numeric_limits<std::uint16_t>::max();
  std::size_t count = 0;
  for (std::size_t first = 0; first < row.size(); first += kMost) {
    Counter part = 0;
    for (const Value value : row.subspan(first, std::min(kMost, row.size() - first)))
      part = static_cast<Counter>(part + Counter{value == label});
    count += part;
  }
  return count;
}

template <class Value>
SliceBox box_in_slice(std::span<Value> slice, const std::array<int, 3>& size,
                      std::remove_const_t<Value> label) {
  SliceBox box;
  const auto columns = static_cast<std::size_t>(size[0]);
  for (int j = 0; j < size[1]; ++j) {
    const auto row = slice.subspan(static_cast<std::size_t>(j) * columns, columns);
    const std::size_t count = count_in_row(row, label);  // most rows hold none
    if (count == 0) continue;
    box.label_voxels += count;
    const auto first = std::find(row.begin(), row.end(), label) - row.begin();
    const auto last = row.rend() - std::find(row.rbegin(), row.rend(), label) - 1;
    box.add(0, static_cast<int>(first), static_cast<int>(last));
    box.add(1, j, j);
  }
  return box;
}

}  // namespace

LabelBox bounding_box(const Volume& mask, int label) {
  std::vector<SliceBox> slices(static_cast<std::size_t>(mask.size[2]));
  with_values(mask, [&](const auto values) {
    using Value = typename decltype(values)::value_type;
    const auto wanted = static_cast<Value>(label);
    if (static_cast<int>(wanted) != label) return;  // no 16 bits can hold it
    const std::size_t voxels = static_cast<std::size_t>(mask.size[0]) * mask.size[1];
    parallel_for(std::size_t{0}, slices.size(), [&](std::size_t k) {
      slices[k] = box_in_slice(values.subspan(k * voxels, voxels), mask.size, wanted);
    });
  });
  LabelBox box;
  SliceBox all;
  for (int k = 0; k < mask.size[2]; ++k) {
    const SliceBox& slice = slices[static_cast<std::size_t>(k)];
    if (slice.label_voxels == 0) continue;
    if (box.label_voxels == 0) box.first[2] = k;
    box.size[2] = k - box.first[2] + 1;
    box.label_voxels += slice.label_voxels;
    for (int axis = 0; axis < 2; ++axis) all.add(axis, slice.low[axis], slice.high[axis]);
  }
  if (box.label_voxels == 0) return box;
  for (int axis = 0; axis < 2; ++axis) {
    box.first[axis] = all.low[axis];
    box.size[axis] = all.high[axis] - all.low[axis] + 1;
  }
  return box;
}

Region region_around(const Volume& mask, const LabelBox& box) {
  constexpr double kAround_voxels = 2;
  const Eigen::Vector3d first(box.first[0], box.first[1], box.first[2]);
  const Eigen::Vector3d last =
      first + Eigen::Vector3d(box.size[0] - 1, box.size[1] - 1, box.size[2] - 1);
  return world_box(mask, first.array() - kAround_voxels, last.array() + kAround_voxels);
}

}  // namespace organbake
