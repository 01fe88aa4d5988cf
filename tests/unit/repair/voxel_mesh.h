// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/geometry/triangle_mesh.h"
#include "support/testing.h"

namespace organbake {

// The faces between voxels inside and outside of a cube of size³ voxels, corners shared: where
// voxels touch at an edge or a corner alone, the mesh is no manifold.
inline TriangleMesh voxel_mesh(int size, double voxel_mm,
                               const std::function<bool(int, int, int)>& inside) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> number;
  const auto vertex = [&](const Eigen::Vector3i& at) {
    const auto [found, added] = number.emplace(std::array<int, 3>{at.x(), at.y(), at.z()},
                                               std::uint32_t(mesh.vertices.size()));
    if (added) mesh.vertices.push_back(voxel_mm * at.cast<double>());
    return found->second;
  };
  const auto in = [&](const Eigen::Vector3i& v) {
    return v.minCoeff() >= 0 && v.maxCoeff() < size && inside(v.x(), v.y(), v.z());
  };
  for (int n = 0; n < size * size * size; ++n) {
    const Eigen::Vector3i v(n % size, n / size % size, n / size / size);
    if (!in(v)) continue;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3i a = Eigen::Vector3i::Unit(axis);
      const Eigen::Vector3i b = Eigen::Vector3i::Unit((axis + 1) % 3);
      const Eigen::Vector3i c = Eigen::Vector3i::Unit((axis + 2) % 3);
      for (const bool high : {false, true}) {
        if (in(high ? Eigen::Vector3i(v + a) : Eigen::Vector3i(v - a))) continue;
        const Eigen::Vector3i o = high ? Eigen::Vector3i(v + a) : v;
        std::uint32_t p[4] = {vertex(o), vertex(o + b), vertex(o + b + c), vertex(o + c)};
        if (!high) std::swap(p[1], p[3]);
        mesh.faces.push_back({p[0], p[1], p[2]});
        mesh.faces.push_back({p[0], p[2], p[3]});
      }
    }
  }
  return mesh;
}

}  // namespace organbake
