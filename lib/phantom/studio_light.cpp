// SPDX-License-Identifier: GPL-3.0-or-later
#include "phantom/studio_light.h"

#include <Eigen/Geometry>

namespace organbake {

const Lighting& studio_lighting() {
  using Eigen::Vector3d;
  static const Lighting lighting = {
      .ambient_above = {0.50, 0.51, 0.53},
      .ambient_below = {0.32, 0.30, 0.28},
      .up = Vector3d::UnitZ(),
      .lamps = {{Vector3d(-0.45, -0.75, 0.48).normalized(), {1.55, 1.49, 1.40}},
                {Vector3d(0.62, 0.58, 0.10).normalized(), {0.60, 0.66, 0.75}}},
      .gloss = {{0.045, 25}, {0.32, 180}},
      .scope = {},
      .finish = {}};
  return lighting;
}

}  // namespace organbake
