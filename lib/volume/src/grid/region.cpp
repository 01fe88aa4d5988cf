// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/volume/region.h"

#include <algorithm>
#include <cmath>

#include "files/header_text.h"
#include "organbake/core/error.h"
#include "organbake/volume/describe.h"

namespace organbake {
namespace {

std::vector<double> six_numbers(const std::string& text, const std::string& where) {
  std::string spaced = text;
  std::replace(spaced.begin(), spaced.end(), ',', ' ');
  std::vector<double> values;
  try {
    values = numbers(spaced, where);
  } catch (const BadDataError&) {
    values.clear();  // a slip on the command line is a usage error, said below
  }
  if (values.size() != 6) {
    throw UsageError(where + ": '" + text +
                     "' is not possible; it takes two corners, x0,y0,z0,x1,y1,z1 in mm (LPS)");
  }
  return values;
}

}  // namespace

Region parse_region(const std::string& text, const std::string& where) {
  const std::vector<double> values = six_numbers(text, where);
  const Eigen::Vector3d a(values[0], values[1], values[2]), b(values[3], values[4], values[5]);
  const Region region = {a.cwiseMin(b), a.cwiseMax(b)};
  if (!((region.max_mm - region.min_mm).minCoeff() > 0)) {
    throw UsageError(where + ": '" + text + "' is a box without volume");
  }
  return region;
}

std::optional<IndexBox> voxels_within(const Volume& grid, const Region& region) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e30), high = -low;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d world;
    for (int axis = 0; axis < 3; ++axis) {
      world[axis] = (corner >> axis & 1) ? region.max_mm[axis] : region.min_mm[axis];
    }
    const Eigen::Vector3d index = grid.index_from_world(world);
    low = low.cwiseMin(index);
    high = high.cwiseMax(index);
  }
  IndexBox box;
  for (int axis = 0; axis < 3; ++axis) {
    const double last = grid.size[axis] - 1;
    const double first = std::clamp(std::floor(low[axis]) - 1, 0.0, last);
    const double end = std::clamp(std::ceil(high[axis]) + 1, 0.0, last);
    if (low[axis] > last + 0.5 || high[axis] < -0.5) return std::nullopt;
    box.first[axis] = static_cast<int>(first);
    box.size[axis] = static_cast<int>(end - first) + 1;
  }
  return box;
}

IndexBox voxels_of_region(const Volume& grid, const Region& region, const std::string& name) {
  const std::optional<IndexBox> box = voxels_within(grid, region);
  if (box) return *box;
  throw BadDataError(name + ": the region of interest lies outside the volume, which covers " +
                     world_range_text(grid) + " mm (LPS)");
}

void crop_grid(Volume& grid, const IndexBox& box) {
  grid.origin_mm = grid.world_from_index(Eigen::Vector3d(box.first[0], box.first[1], box.first[2]));
  grid.size = box.size;
}

Volume cropped(Volume volume, const IndexBox& box) {
  if (box.is_whole(volume)) return volume;
  // In place: every row moves towards the front, past what has been read already.
  with_values(volume, [&](const auto values) {
    auto to = values.begin();
    for (int k = 0; k < box.size[2]; ++k) {
      for (int j = 0; j < box.size[1]; ++j) {
        const std::size_t row = std::size_t(box.first[2] + k) * volume.size[1] + box.first[1] + j;
        const auto from = values.subspan(row * volume.size[0] + box.first[0], box.size[0]);
        to = std::copy(from.begin(), from.end(), to);
      }
    }
  });
  crop_grid(volume, box);
  const auto shrink = [&](auto& values) {
    values.resize(box.voxels());
    values.shrink_to_fit();
  };
  volume.is_real() ? shrink(volume.reals) : shrink(volume.voxels);
  return volume;
}

}  // namespace organbake
