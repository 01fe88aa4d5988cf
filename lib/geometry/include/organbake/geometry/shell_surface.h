// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "organbake/geometry/shell_map.h"
#include "organbake/geometry/smooth_skin.h"
#include "organbake/geometry/triangle_mesh.h"

namespace organbake {

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
