// SPDX-License-Identifier: GPL-3.0-or-later
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cmath>

#include "core/error.h"
#include "volume/describe.h"
#include "volume/index_map.h"
#include "volume/read_volume.h"

namespace organbake {
namespace {

// One slice of the grid, voxel by voxel; returns how many fell inside the mask's grid.
std::size_t fill_slice(const Volume& mask, const IndexMap& mask_from_grid, int k, Volume& out) {
  std::size_t inside = 0;
  std::int16_t* voxel = out.voxels.data() + std::size_t(k) * out.size[0] * out.size[1];
  for (int j = 0; j < out.size[1]; ++j) {
    for (int i = 0; i < out.size[0]; ++i, ++voxel) {
      const Eigen::Vector3d at = mask_from_grid(Eigen::Vector3d(i, j, k));
      const std::size_t nearest = nearest_voxel(mask, at);
      if (nearest == kOutside) continue;
      *voxel = mask.voxels[nearest];
      ++inside;
    }
  }
  return inside;
}

}  // namespace

Volume resample_mask(const Volume& mask, const Volume& grid) {
  if (same_grid(mask, grid)) return mask;
  Volume out;
  out.size = grid.size;
  out.spacing_mm = grid.spacing_mm;
  out.origin_mm = grid.origin_mm;
  out.direction = grid.direction;
  out.warnings = mask.warnings;
  out.label_names = mask.label_names;
  out.chosen_label = mask.chosen_label;
  out.chosen_name = mask.chosen_name;
  out.voxels.assign(grid.voxels.size(), 0);
  const IndexMap mask_from_grid(mask, grid);
  std::vector<std::size_t> inside(static_cast<std::size_t>(grid.size[2]), 0);
  tbb::parallel_for(tbb::blocked_range<int>(0, grid.size[2]), [&](const auto& slices) {
    for (int k = slices.begin(); k < slices.end(); ++k) {
      inside[static_cast<std::size_t>(k)] = fill_slice(mask, mask_from_grid, k, out);
    }
  });
  std::size_t total = 0;
  for (const std::size_t n : inside) total += n;
  if (total == 0) {
    throw BadDataError("the mask does not overlap the CT: the mask covers " +
                       world_range_text(mask) + ", the CT " + world_range_text(grid) +
                       " mm (LPS); they are not of one patient or one header is wrong");
  }
  return out;
}

}  // namespace organbake
