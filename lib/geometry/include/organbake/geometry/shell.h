// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "organbake/geometry/smooth_skin.h"
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

// Finds the prism that holds a point: of all faces that hold it, the one with the smallest |h|
// (then the smallest index); a point in no prism is bound unclamped to the face of the nearest
// proxy point, or, where that would take a height or a place far off, to the face it leaves least.
// Thread-safe after construction.
class ShellBinder {
 public:
  // max_height_mm bounds |h| in the prism search; points farther away take the unclamped way.
  // Throws BadDataError for an empty proxy or one whose faces are all degenerate.
  ShellBinder(const TriangleMesh& proxy, double max_height_mm);
  ~ShellBinder();
  ShellBinder(ShellBinder&&) noexcept;

  ShellBinding bind(const Eigen::Vector3d& point) const;
  // Of many points, faster where neighbours lie next to each other; as bind() up to rounding.
  void bind(std::span<const Eigen::Vector3d> points, std::span<ShellBinding> bindings) const;
  // Whether the point lies in the prism that it was bound to: not when by the fallback.
  bool inside(const ShellBinding& binding, const Eigen::Vector3d& point) const;
  // Whether a face and a height alone give the point back (rejoined_point) to within_mm. Where a
  // body's prisms close, deep below its skin, no face's rounded height does.
  bool gives_back(std::uint32_t face, double height_mm, const Eigen::Vector3d& point,
                  double within_mm) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// The surface that samples are bound to, and that moves with the proxy: a smooth skin over it, or
// where there is none (bundles of version 1) the proxy itself.
class ShellSurface {
 public:
  // Throws BadDataError for a skin that does not fit the proxy.
  explicit ShellSurface(TriangleMesh proxy, std::optional<SmoothSkin> skin = std::nullopt);

  const TriangleMesh& proxy() const { return proxy_; }  // at rest
  const std::optional<SmoothSkin>& skin() const { return skin_; }
  // At rest, without colours.
  const TriangleMesh& at_rest() const { return rest_; }
  // Its vertices when the proxy's lie at `proxy_positions` (mm), of which there must be as many.
  void pose(const std::vector<Eigen::Vector3d>& proxy_positions,
            std::vector<Eigen::Vector3d>& positions) const;
  TriangleMesh posed(const std::vector<Eigen::Vector3d>& proxy_positions) const;
  // The shell over it then, by face: bent where it is a smooth skin.
  std::vector<ShellMatrix> posed_matrices(
      const std::vector<Eigen::Vector3d>& proxy_positions) const;
  // How far from it (mm) the points of a surface it was made for may lie, with much to spare.
  double reach_mm() const;
  // How many of its faces lie over each of the proxy's, one after the other.
  std::size_t faces_per_proxy_face() const { return skin_ ? skin_->faces_per_proxy_face() : 1; }

 private:
  TriangleMesh proxy_;
  std::optional<SmoothSkin> skin_;
  TriangleMesh rest_;
};

}  // namespace organbake
