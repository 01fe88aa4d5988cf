// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// Points spread evenly by area over a mesh: point i lies in the i-th of equal slices of the area
// (stratification), at random in its face; one random stream a point. Keeps a reference to the
// mesh. Throws BadDataError when the mesh has no (finite) area.
class AreaSampler {
 public:
  AreaSampler(const TriangleMesh& mesh, std::size_t samples, std::uint64_t seed);
  struct Sample {
    std::uint32_t face;
    Eigen::Vector3d weights;  // of the face's corners, sum 1
    Eigen::Vector3d point;    // mm
  };
  Sample at(std::size_t i) const;
  Eigen::Vector3d operator()(std::size_t i) const { return at(i).point; }
  double area_mm2() const { return cumulative_.back(); }

 private:
  const TriangleMesh& mesh_;
  std::vector<double> cumulative_;
  std::size_t samples_;
  std::uint64_t seed_;
};

}  // namespace organbake
