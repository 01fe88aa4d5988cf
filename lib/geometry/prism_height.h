// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "geometry/shell_map.h"

namespace organbake {

// The heights h at which `point` lies in the plane of the face's triangle offset by h: real roots
// of det[E1(h), E2(h), P − X0(h)] = 0, a cubic in h, within ±max_height, increasing |h|.
struct PrismHeights {
  std::array<double, 3> heights{};
  int count = 0;
};
PrismHeights prism_heights(const ShellMatrix& m, const Eigen::Vector3d& point, double max_height);

}  // namespace organbake
