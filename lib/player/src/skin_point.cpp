// SPDX-License-Identifier: Apache-2.0
// Where a line from an organ's centre meets its skin at rest: the farthest crossing with the
// triangles of the base layer's lattice. From it follow the places of pokes and the thickness
// there.
#include "organbake/player/skin_point.h"

#include <Eigen/Geometry>
#include <optional>

#include "line_crossing.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/geometry/shell.h"

namespace organbake {
namespace {

// How far from the organ's centre the skin lies along a unit direction, the farthest there is;
// negative where all of it lies behind, as that of an open surface that is hollow may.
std::optional<double> distance_to_skin(const Bundle& bundle, const Eigen::Vector3d& d) {
  const Eigen::Vector3d center = bundle.cameras.manifold.center_world_mm;
  const TriangleMesh shell = bundle.shell().at_rest();
  const std::vector<Eigen::Vector3d> normals = vertex_normals(shell);
  const BaseLayer& base = bundle.base;
  const std::uint32_t n = base.steps;
  const double extent_mm = bounds(shell).diagonal();
  std::optional<double> farthest;
  const auto meet = [&](std::optional<double> distance) {
    // What lies farther behind is beside the organ, not in its hollow.
    if (!distance || *distance < -extent_mm) return;
    if (!farthest || *distance > *farthest) farthest = distance;
  };
  for (std::uint32_t f = 0; f < base.face_count; ++f) {
    const ShellMatrix m = shell_matrix(shell, normals, f);
    const float* heights = &base.height_mm[std::size_t(f) * base.nodes_per_face()];
    const auto node = [&](std::uint32_t i, std::uint32_t j) {
      return shell_point(m, double(i) / n, double(j) / n, heights[base_node_index(n, i, j)]);
    };
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t j = 0; i + j < n; ++j) {
        const Eigen::Vector3d a = node(i, j), b = node(i + 1, j), c = node(i, j + 1);
        meet(line_crossing(center, d, a, b, c));
        if (i + j + 1 < n) meet(line_crossing(center, d, b, node(i + 1, j + 1), c));
      }
    }
  }
  return farthest;
}

}  // namespace

Eigen::Vector3d skin_point(const Bundle& bundle, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d d = direction.normalized();
  const std::optional<double> distance = distance_to_skin(bundle, d);
  if (!distance) {
    throw BadDataError("no skin lies in the direction (" + to_text(d.x(), 3) + ", " +
                       to_text(d.y(), 3) + ", " + to_text(d.z(), 3) + ") from the organ's centre");
  }
  return bundle.cameras.manifold.center_world_mm + *distance * d;
}

Eigen::Vector3d poke_direction(const Bundle& bundle) {
  for (const Eigen::Vector3d& d : bundle.cameras.manifold.directions) {
    if (distance_to_skin(bundle, d.normalized())) return d;
  }
  throw BadDataError("no camera looks at skin over the organ's centre");
}

double thickness_mm(const Bundle& bundle, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d skin = skin_point(bundle, direction), d = direction.normalized();
  constexpr double kShareOfExtent = 0.25;
  const std::optional<double> behind = distance_to_skin(bundle, -d);
  const bool hollow = d.dot(skin - bundle.cameras.manifold.center_world_mm) < 0;
  if (hollow || !behind || *behind < 0) return kShareOfExtent * bounds(bundle.proxy).diagonal();
  return (skin - bundle.cameras.manifold.center_world_mm).norm() + *behind;
}

}  // namespace organbake
