// SPDX-License-Identifier: GPL-3.0-or-later
// How much of a mask each label takes, and the box that it lies in.
#include <algorithm>
#include <cmath>
#include <map>
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

  void add(const Eigen::Vector3i& first, const Eigen::Vector3i& last, std::size_t count) {
    low = voxels == 0 ? first : low.cwiseMin(first);
    high = voxels == 0 ? last : high.cwiseMax(last);
    voxels += count;
  }
};

// By runs along a row: a mask has few of them, whatever its size.
std::map<int, LabelBounds> bounds_by_label(const Volume& mask) {
  std::vector<std::map<int, LabelBounds>> slices(static_cast<std::size_t>(mask.size[2]));
  with_values(mask, [&](const auto values) {
    const std::size_t voxels = static_cast<std::size_t>(mask.size[0]) * mask.size[1];
    parallel_for(0, mask.size[2], [&](int k) {
      auto row = values.data() + static_cast<std::size_t>(k) * voxels;
      for (int j = 0; j < mask.size[1]; ++j, row += mask.size[0]) {
        for (int i = 0, end = 0; i < mask.size[0]; i = end) {
          for (end = i + 1; end < mask.size[0] && row[end] == row[i];) ++end;
          if (!std::isfinite(static_cast<float>(row[i])) || row[i] == 0) continue;
          slices[k][static_cast<int>(row[i])].add({i, j, k}, {end - 1, j, k}, end - i);
        }
      }
    });
  });
  std::map<int, LabelBounds> found;
  for (const auto& slice : slices)
    for (const auto& [label, part] : slice) found[label].add(part.low, part.high, part.voxels);
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

std::vector<LabelCount> count_labels(const Volume& mask) {
  std::vector<LabelCount> labels;
  for (const auto& [label, bounds] : bounds_by_label(mask))
    labels.push_back({label, bounds.voxels});
  return labels;
}

LabelBox bounding_box(const Volume& mask, int label) {
  const auto all = bounds_by_label(mask);
  const auto found = all.find(label);
  LabelBox box;
  if (found == all.end()) return box;
  const LabelBounds& bounds = found->second;
  box.label_voxels = bounds.voxels;
  for (int axis = 0; axis < 3; ++axis) {
    box.first[axis] = bounds.low[axis];
    box.size[axis] = bounds.high[axis] - bounds.low[axis] + 1;
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
