// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

namespace organbake {

// x_target = rotation · x_source + translation. Named target_from_source wherever one is stored:
// camera_from_world maps world millimetres (LPS) to camera millimetres (OpenCV axes).
struct RigidTransform {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation * point + translation;
  }
  RigidTransform operator*(const RigidTransform& other) const {
    return {rotation * other.rotation, rotation * other.translation + translation};
  }
  [[nodiscard]] RigidTransform inverse() const {
    return {rotation.transpose(), -(rotation.transpose() * translation)};
  }
};

// Whether RᵀR is the identity, to `tolerance` in every entry, and R does not mirror.
bool is_rotation(const Eigen::Matrix3d& r, double tolerance);

// What is up for who looks from this direction (of any length, from the organ): superior, +z;
// within 30° of that axis, where it tells nothing, −y, which is what a camera that looks along +z
// has at its top, as a scope's first frame is filmed, and axial slices are shown.
Eigen::Vector3d up_from(const Eigen::Vector3d& direction_world);

// camera_from_world of a camera at `eye` that looks at `target` with image-up along `up`
// (mm, world). When `up` is parallel to the view, the world axis least aligned with it is taken.
RigidTransform look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target,
                       const Eigen::Vector3d& up);

// Nothing that is meant lies farther from the origin: squares of such lengths lose the organ's
// millimetres, and rays overflow the floats they are traced in.
inline constexpr double kFarthest_mm = 1e9;
// Finite, and no coordinate beyond it. Eigen's largest coefficient passes over some NaN, so that
// both must be asked.
inline bool within_reach(const Eigen::Vector3d& position_mm) {
  return position_mm.allFinite() && position_mm.cwiseAbs().maxCoeff() <= kFarthest_mm;
}

// A rotation that was written down: itself where RᵀR is the identity to rounding, the nearest
// rotation where it is within 1e-4 in every entry (people and programs write four to six digits),
// nothing for what is no rotation or mirrors.
[[nodiscard]] std::optional<Eigen::Matrix3d> written_rotation(const Eigen::Matrix3d& r);

// The least turn that brings the direction `from` to `to`, both of any length but 0. Eigen's own
// template, which takes GCC fifteen seconds in each file that uses it, compiled once.
[[nodiscard]] Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from,
                                                  const Eigen::Vector3d& to);

}  // namespace organbake
