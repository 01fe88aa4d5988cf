// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/label_box.h"

#include <algorithm>

namespace organbake {

LabelBox bounding_box(const Volume& mask, int label) {
  std::array<int, 3> low = mask.size, high = {-1, -1, -1};
  LabelBox box;
  with_values(mask, [&](const auto values) {
    const auto columns = static_cast<std::size_t>(mask.size[0]);
    for (int k = 0; k < mask.size[2]; ++k) {
      for (int j = 0; j < mask.size[1]; ++j) {
        const auto row =
            values.subspan((static_cast<std::size_t>(k) * mask.size[1] + j) * columns, columns);
        // Counting takes many voxels at once, and most rows hold none.
        const std::ptrdiff_t count = std::count(row.begin(), row.end(), label);
        if (count == 0) continue;
        box.label_voxels += static_cast<std::size_t>(count);
        const auto first = std::find(row.begin(), row.end(), label) - row.begin();
        const auto last = row.rend() - std::find(row.rbegin(), row.rend(), label) - 1;
        const std::array<int, 3> from = {static_cast<int>(first), j, k};
        const std::array<int, 3> to = {static_cast<int>(last), j, k};
        for (int axis = 0; axis < 3; ++axis) {
          low[axis] = std::min(low[axis], from[axis]);
          high[axis] = std::max(high[axis], to[axis]);
        }
      }
    }
  });
  if (box.label_voxels == 0) return box;
  box.first = low;
  for (int axis = 0; axis < 3; ++axis) box.size[axis] = high[axis] - low[axis] + 1;
  return box;
}

Region region_around(const Volume& mask, const LabelBox& box) {
  constexpr double kAround_voxels = 2;
  Region region = {Eigen::Vector3d::Constant(1e30), Eigen::Vector3d::Constant(-1e30)};
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d index;
    for (int axis = 0; axis < 3; ++axis) {
      const double last = box.first[axis] + box.size[axis] - 1;
      index[axis] = (corner >> axis & 1) ? last + kAround_voxels : box.first[axis] - kAround_voxels;
    }
    region.min_mm = region.min_mm.cwiseMin(mask.world_from_index(index));
    region.max_mm = region.max_mm.cwiseMax(mask.world_from_index(index));
  }
  return region;
}

}  // namespace organbake
