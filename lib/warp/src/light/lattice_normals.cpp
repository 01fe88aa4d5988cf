// SPDX-License-Identifier: Apache-2.0
#include "light/lattice_normals.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "organbake/geometry/lattice.h"
#include "organbake/geometry/shell_map.h"

namespace organbake {
namespace {

using Eigen::Vector3d;

// One face's alone, not of unit length, added to its nodes'.
void add_face(const BaseLayer& layer, const ShellMatrix& shell, const float* height_mm,
              Vector3d* normals) {
  const std::uint32_t n = layer.steps;
  std::vector<Vector3d> points(layer.nodes_per_face());
  each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
    points[node] = shell_point(shell, double(i) / n, double(j) / n, height_mm[node]);
  });
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const Vector3d normal = (points[b] - points[a]).cross(points[c] - points[a]);
    for (const std::uint32_t node : {a, b, c}) normals[node] += normal;
  };
  each_node(n, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
    if (i + j + 1 > n) return;
    const std::uint32_t down = base_node_index(n, i + 1, j), right = base_node_index(n, i, j + 1);
    add(node, down, right);
    if (i + j + 2 <= n) add(down, base_node_index(n, i + 1, j + 1), right);
  });
}

// Narrower than this share of a usual face, lattice triangles are so small that the rounding of
// their heights turns them about.
constexpr double kNarrow = 1.0 / 8;

double altitude(const TriangleMesh& proxy, std::uint32_t face) {
  const Face& f = proxy.faces[face];
  double longest = 0;
  for (int k = 0; k < 3; ++k)
    longest = std::max(longest, (proxy.vertices[f[k]] - proxy.vertices[f[(k + 1) % 3]]).norm());
  return longest > 0 ? 2 * face_area(proxy, face) / longest : 0;
}

double usual_size(const TriangleMesh& proxy) {
  return std::sqrt(2 * surface_area(proxy) / double(std::max<std::size_t>(1, proxy.faces.size())));
}

// Spreads the normals on a face's rim over its inner nodes, each of which becomes the mean of its
// neighbours.
void spread_rim(std::uint32_t steps, Vector3d* normals) {
  const auto at = [&](std::uint32_t i, std::uint32_t j) -> Vector3d& {
    return normals[base_node_index(steps, i, j)];
  };
  const auto each_inner = [&](auto&& visit) {
    for (std::uint32_t i = 1; i < steps; ++i)
      for (std::uint32_t j = 1; i + j < steps; ++j) visit(i, j);
  };
  const Vector3d corners = at(0, 0) + at(steps, 0) + at(0, steps);
  each_inner([&](std::uint32_t i, std::uint32_t j) { at(i, j) = corners.stableNormalized(); });
  for (std::uint32_t sweep = 0; sweep < steps; ++sweep) {
    each_inner([&](std::uint32_t i, std::uint32_t j) {
      at(i, j) = (at(i + 1, j) + at(i - 1, j) + at(i, j + 1) + at(i, j - 1) + at(i + 1, j - 1) +
                  at(i - 1, j + 1))
                     .stableNormalized();
    });
  }
}

}  // namespace

std::vector<Vector3d> lattice_normals(const BaseLayer& layer, const TriangleMesh& whole,
                                      std::uint32_t first_face) {
  const std::size_t per_face = layer.nodes_per_face();
  TriangleMesh proxy;
  proxy.vertices = whole.vertices;
  proxy.faces.assign(whole.faces.begin() + first_face, whole.faces.end());
  const auto count = static_cast<std::uint32_t>(proxy.faces.size());
  const std::vector<ShellMatrix> shells = shell_matrices(proxy);
  const Lattice lattice(proxy, layer.steps);
  std::vector<Vector3d> joined(lattice.node_count(), Vector3d::Zero());
  for (std::uint32_t f = 0; f < count; ++f) {
    std::vector<Vector3d> own(per_face, Vector3d::Zero());
    add_face(layer, shells[f], &layer.height_mm[(first_face + f) * per_face], own.data());
    each_node(layer.steps, [&](std::uint32_t i, std::uint32_t j, std::uint32_t node) {
      joined[lattice.node(f, i, j)] += own[node];
    });
  }
  for (Vector3d& normal : joined) normal.stableNormalize();
  std::vector<Vector3d> normals(first_face * per_face, Vector3d::Zero());
  normals.reserve(layer.face_count * per_face);
  for (std::uint32_t f = 0; f < count; ++f) {
    each_node(layer.steps, [&](std::uint32_t i, std::uint32_t j, std::uint32_t) {
      normals.push_back(joined[lattice.node(f, i, j)]);
    });
  }
  const double narrow_mm = kNarrow * usual_size(whole);
  for (std::uint32_t f = first_face; f < layer.face_count; ++f)
    if (altitude(whole, f) < narrow_mm) spread_rim(layer.steps, &normals[f * per_face]);
  return normals;
}

std::uint32_t first_wall(std::size_t uncut_faces, const CutOrgan::FaceParts& parts) {
  auto first = static_cast<std::uint32_t>(uncut_faces);
  for (const auto& [face, pieces] : parts)
    for (const CutOrgan::FacePart& part : pieces) first = std::max(first, part.face + 1);
  return first;
}

void keep_uncut_normals(const std::vector<Eigen::Vector3f>& uncut, const CutOrgan::FaceParts& parts,
                        const BaseLayer& layer, std::vector<Vector3d>& normals) {
  const std::size_t per_face = layer.nodes_per_face();
  for (std::size_t node = 0; node < uncut.size(); ++node)
    normals[node] = uncut[node].cast<double>();
  for (const auto& [face, pieces] : parts) {
    const Eigen::Vector3f* whole = &uncut[face * per_face];
    for (const CutOrgan::FacePart& part : pieces) {
      CutOrgan::each_mixed_node(layer.steps, part, [&](std::uint32_t node, const LatticeMix& mix) {
        Eigen::Vector3f normal = Eigen::Vector3f::Zero();
        for (int k = 0; k < 3; ++k) normal += mix.weights[k] * whole[mix.nodes[k]];
        normals[part.face * per_face + node] = normal.cast<double>().stableNormalized();
      });
    }
  }
}

}  // namespace organbake
