// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "organbake/cutting/blade_path.h"

namespace organbake {

// What the blades of scissors cut as they close: where their edges cross runs from the pivot to the
// tips, and all that lay between the blades behind it is parted. It is a blade that stands across
// the tool, as long as the opening was there when the blades began to close.
class Scissors {
 public:
  struct Snip {
    std::optional<Blade> put_down;  // first, where the blades begin to close
    Blade blade;
  };
  // One step. tip_mm: half-way between the tips; pivot_mm: where the blades hang together;
  // opening_mm: from the one tip to the other. Nothing, unless the opening became less.
  std::optional<Snip> advance(const Eigen::Vector3d& tip_mm, const Eigen::Vector3d& pivot_mm,
                              const Eigen::Vector3d& opening_mm);

 private:
  Eigen::Vector3d opened_mm_ = Eigen::Vector3d::Zero();  // when they began to close
  double last_mm_ = 0;
};

}  // namespace organbake
