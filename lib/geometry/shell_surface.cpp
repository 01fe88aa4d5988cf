// SPDX-License-Identifier: Apache-2.0
#include "geometry/shell_surface.h"

#include <utility>

namespace organbake {

ShellSurface::ShellSurface(TriangleMesh proxy, std::optional<SmoothSkin> skin)
    : proxy_(std::move(proxy)), skin_(std::move(skin)) {
  proxy_.colors.clear();
  if (skin_) check_smooth_skin(*skin_, proxy_, "smooth skin");
  rest_ = skin_ ? smooth_skin_mesh(proxy_, *skin_) : proxy_;
}

void ShellSurface::pose(const std::vector<Eigen::Vector3d>& proxy_positions,
                        std::vector<Eigen::Vector3d>& positions) const {
  if (skin_) {
    carry(*skin_, proxy_positions, positions);
  } else {
    positions = proxy_positions;
  }
}

double ShellSurface::reach_mm() const {
  // Any height may occur over a coarse proxy; half the organ is beyond all of them and keeps the
  // search bounded. A skin follows the surface.
  return (skin_ ? 0.05 : 0.5) * bounds(rest_).diagonal();
}

TriangleMesh ShellSurface::posed(const std::vector<Eigen::Vector3d>& proxy_positions) const {
  TriangleMesh mesh;
  mesh.faces = rest_.faces;
  pose(proxy_positions, mesh.vertices);
  return mesh;
}

}  // namespace organbake
