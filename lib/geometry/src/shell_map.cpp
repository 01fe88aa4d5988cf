// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/shell_map.h"

#include <cmath>

namespace organbake {

ShellMatrix shell_matrix(const TriangleMesh& proxy, const std::vector<Eigen::Vector3d>& normals,
                         std::uint32_t face) {
  const auto [i, j, k] = proxy.faces[face];
  ShellMatrix m;
  m.col(0) = proxy.vertices[i];
  m.col(1) = proxy.vertices[j] - proxy.vertices[i];
  m.col(2) = proxy.vertices[k] - proxy.vertices[i];
  m.col(3) = normals[i];
  m.col(4) = normals[j] - normals[i];
  m.col(5) = normals[k] - normals[i];
  m.rightCols<3>().setZero();
  return m;
}

std::vector<ShellMatrix> shell_matrices(const TriangleMesh& proxy) {
  const std::vector<Eigen::Vector3d> normals = vertex_normals(proxy);
  std::vector<ShellMatrix> matrices(proxy.faces.size());
  for (std::uint32_t f = 0; f < matrices.size(); ++f) matrices[f] = shell_matrix(proxy, normals, f);
  return matrices;
}

Eigen::Vector2d barycentric_at_height(const ShellMatrix& m, double h,
                                      const Eigen::Vector3d& point) {
  const Eigen::Vector3d e1 = m.col(1) + h * m.col(4);
  const Eigen::Vector3d e2 = m.col(2) + h * m.col(5);
  const Eigen::Vector3d d = point - m.col(0) - h * m.col(3);
  const double a = e1.dot(e1), b = e1.dot(e2), c = e2.dot(e2);
  const double determinant = a * c - b * b;
  if (!(std::abs(determinant) > 0)) return Eigen::Vector2d::Constant(1.0 / 3);  // a collapsed face
  const double r1 = e1.dot(d), r2 = e2.dot(d);
  return {(c * r1 - b * r2) / determinant, (a * r2 - b * r1) / determinant};
}

Eigen::Vector3d rejoined_point(const ShellMatrix& m, double h, const Eigen::Vector3d& point) {
  const Eigen::Vector2d b = barycentric_at_height(m, h, point);
  return shell_point(m, b.x(), b.y(), h);
}

}  // namespace organbake
