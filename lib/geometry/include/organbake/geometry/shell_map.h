// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

// The shell around a proxy: over face (x0, x1, x2) with vertex normals n_i the prism
//   S(b, h) = Σ b_i x_i + h Σ b_i n_i,   b0 = 1 − b1 − b2,   h in mm,
// so the proxy is the macrostructure and h the microstructure (the paper, 2.1.4). A point is bound
// once, at rest, and follows the deformed proxy ever after.
struct ShellBinding {
  std::uint32_t face = 0;
  double b1 = 0, b2 = 0;  // outside 0…1 only for a point that lies in no prism
  double height_mm = 0;
};

// S = M · (1, b1, b2, h, h·b1, h·b2, b1², b1·b2, b2²)ᵀ. The last three columns bend a face of a
// smooth skin (geometry/vertex_gradients.h); a flat one's are zero, and a sample of it takes 15
// multiply-adds.
using ShellMatrix = Eigen::Matrix<double, 3, 9>;
// Flat.
ShellMatrix shell_matrix(const TriangleMesh& proxy, const std::vector<Eigen::Vector3d>& normals,
                         std::uint32_t face);
std::vector<ShellMatrix> shell_matrices(const TriangleMesh& proxy);  // of every face
inline bool is_bent(const ShellMatrix& m) { return !m.rightCols<3>().isZero(0); }
// Of any matrix with these columns.
template <class Columns>
Eigen::Matrix<typename Columns::Scalar, Columns::RowsAtCompileTime, 1> shell_point(
    const Columns& m, typename Columns::Scalar b1, typename Columns::Scalar b2,
    typename Columns::Scalar h) {
  return m.col(0) + b1 * (m.col(1) + b1 * m.col(6) + b2 * m.col(7)) +
         b2 * (m.col(2) + b2 * m.col(8)) + h * (m.col(3) + b1 * m.col(4) + b2 * m.col(5));
}
// Of shell_point by b1, b2 and h.
inline Eigen::Matrix3d shell_jacobian(const ShellMatrix& m, double b1, double b2, double h) {
  Eigen::Matrix3d by;
  by << m.col(1) + h * m.col(4) + 2 * b1 * m.col(6) + b2 * m.col(7),
      m.col(2) + h * m.col(5) + 2 * b2 * m.col(8) + b1 * m.col(7),
      m.col(3) + b1 * m.col(4) + b2 * m.col(5);
  return by;
}

// b1, b2 of a point known to lie at height h over a flat face: linear, least squares in 3-D.
Eigen::Vector2d barycentric_at_height(const ShellMatrix& m, double h, const Eigen::Vector3d& point);
// Macro + micro: what a height over a face alone, as maps store it, makes of the point that it was
// stored for.
Eigen::Vector3d rejoined_point(const ShellMatrix& m, double h, const Eigen::Vector3d& point);

}  // namespace organbake
