// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/rotation_between.h"

#include <Eigen/SVD>

namespace organbake {

Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

}  // namespace organbake
