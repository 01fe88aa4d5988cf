// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <map>

#include "geometry/triangle_mesh.h"

namespace organbake {

// A closed box round the origin, every side a regular grid of 2·cells² triangles: rays can be
// aimed at its vertices, and cells can be merged again without error.
inline TriangleMesh grid_box(const Eigen::Vector3d& size, int cells) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> known;
  const auto vertex = [&](const std::array<int, 3>& at) {
    const auto [found, added] = known.emplace(at, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (added) {
      const Eigen::Vector3d share = Eigen::Vector3d(at[0], at[1], at[2]) / cells;
      mesh.vertices.push_back(size.cwiseProduct(share - Eigen::Vector3d::Constant(0.5)));
    }
    return found->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {0, cells}) {
      for (int cell = 0; cell < cells * cells; ++cell) {
        const auto at = [&](int di, int dj) {
          std::array<int, 3> corner{};
          corner[axis] = side;
          corner[(axis + 1) % 3] = cell / cells + di;
          corner[(axis + 2) % 3] = cell % cells + dj;
          return vertex(corner);
        };
        std::uint32_t a = at(0, 0), b = at(1, 0), c = at(1, 1), d = at(0, 1);
        if (side == 0) std::swap(b, d);
        mesh.faces.push_back({a, b, c});
        mesh.faces.push_back({a, c, d});
      }
    }
  }
  return mesh;
}

inline TriangleMesh moved(TriangleMesh mesh, const Eigen::Vector3d& by) {
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex += by;
  return mesh;
}

inline TriangleMesh scaled(TriangleMesh mesh, double factor) {
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex *= factor;
  return mesh;
}

// Both meshes in one, nothing merged.
inline TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
  const auto offset = static_cast<std::uint32_t>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  a.colors.insert(a.colors.end(), b.colors.begin(), b.colors.end());
  for (const Face& f : b.faces) a.faces.push_back({f[0] + offset, f[1] + offset, f[2] + offset});
  return a;
}

}  // namespace organbake
