// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/shell_surface.h"

#include <utility>

#include "organbake/geometry/vertex_gradients.h"

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

std::vector<ShellMatrix> ShellSurface::posed_matrices(
    const std::vector<Eigen::Vector3d>& proxy_positions) const {
  const TriangleMesh mesh = posed(proxy_positions);
  if (!skin_) return shell_matrices(mesh);
  const VertexGradients gradients(rest_);
  const std::vector<Eigen::Vector3d> normals = vertex_normals(mesh);
  std::vector<Eigen::Matrix3d> changes(mesh.vertices.size());
  for (std::uint32_t v = 0; v < changes.size(); ++v)
    changes[v] =
        skin_->is_creased(v) ? unknown_change() : gradients.change(v, mesh.vertices, normals);
  std::vector<ShellMatrix> matrices(mesh.faces.size());
  for (std::uint32_t f = 0; f < matrices.size(); ++f) {
    matrices[f] = shell_matrix(mesh, normals, f);
    bend_face(rest_, f, changes, matrices[f]);
  }
  return matrices;
}

}  // namespace organbake
