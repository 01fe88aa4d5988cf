// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>
#include <optional>

namespace organbake {

// A steel shaft of 5 mm with a round end, through a fixed port at the right of the world's origin:
// between 30 and 70 % of a clip its tip comes in over the tissue, sweeps across and leaves again.
class CrossingInstrument {
 public:
  static constexpr double kDiameter_mm = 5;

  // As it stands after a share 0…1 of the clip.
  explicit CrossingInstrument(double share);

  // Where a ray (world mm) first meets it: its length, and the outward normal there. Nothing where
  // it passes.
  struct Hit {
    double length;
    Eigen::Vector3d normal;
  };
  std::optional<Hit> first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) const;

  // Whether it reaches into the scene at all.
  bool inside() const { return inside_; }
  const Eigen::Vector3d& tip_mm() const { return tip_; }

 private:
  bool inside_ = false;
  Eigen::Vector3d tip_, port_;
};

}  // namespace organbake
