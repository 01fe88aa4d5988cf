// SPDX-License-Identifier: GPL-3.0-or-later
#include "pixel_slopes.h"

namespace organbake {

Eigen::Matrix<double, 2, 3> pixel_slopes(const Intrinsics& lens, const Eigen::Vector3d& point) {
  constexpr double kStep = 1e-6;
  const double x = point.x() / point.z(), y = point.y() / point.z();
  const Eigen::Vector2d along_x = (project(lens, Eigen::Vector3d(x + kStep, y, 1)) -
                                   project(lens, Eigen::Vector3d(x - kStep, y, 1))) /
                                  (2 * kStep);
  const Eigen::Vector2d along_y = (project(lens, Eigen::Vector3d(x, y + kStep, 1)) -
                                   project(lens, Eigen::Vector3d(x, y - kStep, 1))) /
                                  (2 * kStep);
  Eigen::Matrix<double, 2, 3> slopes;
  slopes << along_x, along_y, -x * along_x - y * along_y;
  return slopes / point.z();
}

}  // namespace organbake
