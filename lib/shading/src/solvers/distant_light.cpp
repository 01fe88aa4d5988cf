// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/distant_light.h"

#include <algorithm>
#include <cmath>

namespace organbake {

Eigen::Vector3d DistantLight::toward() const {
  return {std::cos(tilt_rad) * std::sin(slant_rad), std::sin(tilt_rad) * std::sin(slant_rad),
          std::cos(slant_rad)};
}

DistantLight distant_light(const Eigen::Vector3d& toward) {
  const Eigen::Vector3d s = toward.normalized();
  return {std::atan2(s.y(), s.x()), std::acos(std::clamp(s.z(), -1.0, 1.0))};
}

double lambert(double p, double q, const Eigen::Vector3d& toward) {
  return (p * toward.x() + q * toward.y() + toward.z()) / std::sqrt(1 + p * p + q * q);
}

}  // namespace organbake
