// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/geometry/camera.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

struct PlacementOptions;

// How cameras frame an organ: all look at the centre of its bounds and hold it whole.
class OrganFrame {
 public:
  // Of the vertices that faces use. Throws BadDataError for a surface without (finite) extent.
  explicit OrganFrame(const TriangleMesh& surface);

  const Eigen::Vector3d& center_mm() const { return center_; }

  // The least common distance of cameras in these directions at which every vertex lies inside
  // every map.
  double common_distance_mm(const std::vector<Eigen::Vector3d>& directions,
                            const PlacementOptions& options, const RunContext& context) const;

  // The camera in a direction, its focal length raised until the organ fills its map; unnamed.
  PosedCamera camera(const Eigen::Vector3d& direction, double distance_mm,
                     const PlacementOptions& options) const;

 private:
  Eigen::Vector3d center_;
  std::vector<Eigen::Vector3d> points_;  // about the centre
  double radius_ = 0;
};

}  // namespace organbake
