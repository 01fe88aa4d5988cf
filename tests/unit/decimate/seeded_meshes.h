// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/core/random.h"
#include "support/meshes.h"
#include "support/testing.h"

namespace organbake {

// A closed plate with `holes` square holes through it: genus = holes. Each cell of its plan has
// `fine`² squares; its thickness is `layers` squares of side 1 mm.
inline TriangleMesh perforated_plate(int holes, int fine, int layers) {
  const int columns = 2 * holes + 1, width = columns * fine, depth = 3 * fine;
  const auto solid = [&](int x, int y, int z) {
    if (x < 0 || y < 0 || z < 0 || x >= width || y >= depth || z >= layers) return false;
    return !((x / fine) % 2 == 1 && y / fine == 1);
  };
  TriangleMesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> known;
  const auto vertex = [&](const std::array<int, 3>& at) {
    const auto [found, added] = known.emplace(at, std::uint32_t(mesh.vertices.size()));
    if (added) mesh.vertices.push_back({double(at[0]), double(at[1]), double(at[2])});
    return found->second;
  };
  for (int x = 0; x < width; ++x) {
    for (int y = 0; y < depth; ++y) {
      for (int z = 0; z < layers; ++z) {
        if (!solid(x, y, z)) continue;
        for (int axis = 0; axis < 3; ++axis) {
          for (const int side : {0, 1}) {
            std::array<int, 3> next{x, y, z};
            next[axis] += side ? 1 : -1;
            if (solid(next[0], next[1], next[2])) continue;
            const auto corner = [&](int di, int dj) {
              std::array<int, 3> at{x, y, z};
              at[axis] += side;
              at[(axis + 1) % 3] += di;
              at[(axis + 2) % 3] += dj;
              return vertex(at);
            };
            std::uint32_t a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
            if (side == 0) std::swap(b, d);
            mesh.faces.push_back({a, b, c});
            mesh.faces.push_back({a, c, d});
          }
        }
      }
    }
  }
  return mesh;
}

// Bends a mesh by a smooth field of its seed; small enough to turn nothing inside out.
inline TriangleMesh bent(TriangleMesh mesh, std::uint64_t seed) {
  const double size = bounds(mesh).diagonal();
  const Eigen::Vector3d center = bounds(mesh).center();
  RandomStream random(seed);
  Eigen::Matrix3d waves, phases;
  for (int i = 0; i < 9; ++i) {
    waves(i) = random.uniform(2, 5) / size;
    phases(i) = random.uniform(0, 6.28);
  }
  for (Eigen::Vector3d& v : mesh.vertices) {
    Eigen::Vector3d by = Eigen::Vector3d::Zero();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        by[i] += 0.03 * size * std::sin(waves(i, j) * (v[j] - center[j]) + phases(i, j));
      }
    }
    v += by;
  }
  return mesh;
}

// The mesh without the faces round a random vertex: a surface with one border loop more.
inline TriangleMesh opened(TriangleMesh mesh, std::uint64_t seed) {
  RandomStream random(seed);
  const Eigen::Vector3d at = mesh.vertices[random.below(mesh.vertices.size())];
  const double radius = 0.12 * bounds(mesh).diagonal();
  std::erase_if(mesh.faces,
                [&](const Face& f) { return (mesh.vertices[f[0]] - at).norm() < radius; });
  return mesh;
}

}  // namespace organbake
