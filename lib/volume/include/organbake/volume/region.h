// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>

#include "organbake/volume/volume.h"

namespace organbake {

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

}  // namespace organbake
