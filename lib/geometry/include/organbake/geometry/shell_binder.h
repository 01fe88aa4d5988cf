// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>

#include "organbake/geometry/shell_map.h"

namespace organbake {

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

}  // namespace organbake
