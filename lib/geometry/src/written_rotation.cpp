// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/written_rotation.h"

#include <Eigen/SVD>

#include "organbake/geometry/rigid_transform.h"

namespace organbake {

std::optional<Eigen::Matrix3d> written_rotation(const Eigen::Matrix3d& r) {
  constexpr double kRounding = 1e-12, kWritten = 1e-4;
  if (!is_rotation(r, kWritten)) return std::nullopt;
  if (is_rotation(r, kRounding)) return r;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(r, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

}  // namespace organbake
