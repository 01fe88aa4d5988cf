// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "organbake/capture/exemplar.h"

namespace organbake {

// The exemplar anywhere on a surface: three cells of a triangle grid on each of three planes, each
// cell from a place of its own that is hashed from the cell, blended by the squares of their
// shares, the planes by the normal (Burley 2019 has the grid, the planes as usual). The same
// colours for any threads.
class ExemplarTexture {
 public:
  explicit ExemplarTexture(Exemplar exemplar);

  // point: world mm; normal: unit. Linear.
  Eigen::Vector3f at(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;
  const Exemplar& exemplar() const { return exemplar_; }

 private:
  // Adds one plane's blend, weight · scores, and the squares of the weights.
  void add_plane(int plane, const Eigen::Vector2d& at_mm, double weight, Eigen::Vector3f& sum,
                 double& squares) const;

  static constexpr std::size_t kQuantiles = 256;

  Eigen::Vector3f blended_at(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;
  void match_channels();

  Exemplar exemplar_;
  double side_mm_;  // of the grid's triangles
  // Of each channel: what is blended, and what the tissue has at the same quantiles.
  std::array<std::array<float, kQuantiles + 1>, 3> blended_{}, wanted_{};
};

}  // namespace organbake
