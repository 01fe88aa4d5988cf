// SPDX-License-Identifier: Apache-2.0
#include "organbake/geometry/rigid_transform.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>

namespace organbake {

bool is_rotation(const Eigen::Matrix3d& r, double tolerance) {
  const double off = (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  return off <= tolerance && r.row(0).cross(r.row(1)).dot(r.row(2)) > 0;
}

Eigen::Vector3d up_from(const Eigen::Vector3d& direction_world) {
  constexpr double kAlong = 0.8660254037844386;  // cosine of 30°
  const bool along = std::abs(direction_world.z()) > kAlong * direction_world.norm();
  return along ? Eigen::Vector3d(-Eigen::Vector3d::UnitY()) : Eigen::Vector3d::UnitZ();
}

RigidTransform look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target,
                       const Eigen::Vector3d& up) {
  const Eigen::Vector3d forward = (target - eye).normalized();
  Eigen::Vector3d right = forward.cross(up);
  constexpr double kParallel = 1e-9;  // sine of the angle below which `up` tells nothing
  if (!(right.norm() > kParallel * up.norm())) {
    Eigen::Index least = 0;
    forward.cwiseAbs().minCoeff(&least);
    right = forward.cross(Eigen::Vector3d::Unit(least));
  }
  right.normalize();
  RigidTransform camera_from_world;
  camera_from_world.rotation.row(0) = right.transpose();
  camera_from_world.rotation.row(1) = forward.cross(right).transpose();
  camera_from_world.rotation.row(2) = forward.transpose();
  camera_from_world.translation = -(camera_from_world.rotation * eye);
  return camera_from_world;
}

std::optional<Eigen::Matrix3d> written_rotation(const Eigen::Matrix3d& r) {
  constexpr double kRounding = 1e-12, kWritten = 1e-4;
  if (!is_rotation(r, kWritten)) return std::nullopt;
  if (is_rotation(r, kRounding)) return r;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(r, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

}  // namespace organbake
