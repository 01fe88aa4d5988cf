// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "organbake/bundle/bundle.h"

namespace organbake {

// What the maps of a bundle show at a place of its surface.
struct MapSample {
  Eigen::Vector3f color;   // linear
  Eigen::Vector3d normal;  // unit, of the surface as fine as the maps have it
};

// Reads colours and normals at places of the surface from all maps that show them, between their
// texels; those that see a place more from the front and with more confidence count for more.
// All maps must have been read. Thread-safe after construction.
class MapSampler {
 public:
  explicit MapSampler(const Bundle& bundle);

  // normal: the surface's, roughly. Nothing where no map shows the place.
  std::optional<MapSample> at(const Eigen::Vector3d& place_mm, const Eigen::Vector3d& normal) const;
  // The median size of what a texel shows, over all maps.
  double texel_mm() const { return texel_mm_; }

 private:
  const Bundle& bundle_;
  std::vector<std::vector<Eigen::Vector3f>> normals_;  // of each camera's texels; zero: none
  double texel_mm_ = 1;
};

}  // namespace organbake
