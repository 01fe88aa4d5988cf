// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/label_figures.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "organbake/core/text.h"

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
    for (const LabelName& known : mask.label_names) {
      if (known.label == label) figures.name = known.name;
    }
    figures.voxels = bounds.voxels;
    figures.volume_ml = static_cast<double>(bounds.voxels) * voxel_ml;
    const Eigen::Vector3d a = mask.world_from_index(bounds.low.cast<double>());
    figures.min_mm = figures.max_mm = a;
    for (int corner = 1; corner < 8; ++corner) {
      Eigen::Vector3d index;
      for (int axis = 0; axis < 3; ++axis) {
        index[axis] = (corner >> axis & 1) ? bounds.high[axis] : bounds.low[axis];
      }
      figures.min_mm = figures.min_mm.cwiseMin(mask.world_from_index(index));
      figures.max_mm = figures.max_mm.cwiseMax(mask.world_from_index(index));
    }
    all.push_back(figures);
  }
  return all;
}

std::string label_line(const LabelFigures& figures) {
  return std::to_string(figures.label) + (figures.name.empty() ? "" : " " + figures.name) + ": " +
         to_text(figures.volume_ml, 1) + " ml, " + std::to_string(figures.voxels) + " voxels, " +
         point(figures.min_mm) + "…" + point(figures.max_mm) + " mm";
}

}  // namespace organbake
