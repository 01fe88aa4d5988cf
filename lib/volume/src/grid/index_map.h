// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>

#include "organbake/volume/volume.h"

namespace organbake {

// Continuous index in one grid → continuous index in another, by way of the world.
class IndexMap {
 public:
  IndexMap(const Volume& target, const Volume& source) {
    offset_ = target.index_from_world(source.world_from_index(Eigen::Vector3d::Zero()));
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = Eigen::Vector3d::Unit(axis);
      linear_.col(axis) = target.index_from_world(source.world_from_index(step)) - offset_;
    }
  }
  Eigen::Vector3d operator()(const Eigen::Vector3d& index) const {
    return linear_ * index + offset_;
  }

 private:
  Eigen::Matrix3d linear_;
  Eigen::Vector3d offset_;
};

// The voxel whose cell holds a continuous index; nothing beyond the volume's cells.
inline std::optional<Eigen::Vector3i> nearest_voxel(const Volume& volume,
                                                    const Eigen::Vector3d& index) {
  Eigen::Vector3i voxel;
  for (int axis = 0; axis < 3; ++axis) {
    const double nearest = std::floor(index[axis] + 0.5);
    if (!(nearest >= 0 && nearest < volume.size[axis])) return std::nullopt;
    voxel[axis] = static_cast<int>(nearest);
  }
  return voxel;
}

}  // namespace organbake
