// SPDX-License-Identifier: GPL-3.0-or-later
// A pose as the solver moves it, about the object's own centre, with its derivatives in the
// picture; and a first one from point pairs.
#include "organbake/registration/object_pose.h"

#include <Eigen/SVD>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "organbake/core/error.h"
#include "pose/poses.h"

namespace organbake {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Quaterniond exponential(const Vector3d& rotation) {
  return Quaterniond(Eigen::AngleAxisd(rotation.norm(), rotation.stableNormalized()));
}

Matrix3d cross_matrix(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

}  // namespace

std::array<double, 7> ObjectPose::to_array() const {
  const auto& q = camera_from_world;
  const auto& c = center_camera_mm;
  return {q.x(), q.y(), q.z(), q.w(), c.x(), c.y(), c.z()};
}

ObjectPose ObjectPose::from_array(const double* values) {
  ObjectPose pose;
  pose.camera_from_world = Quaterniond(values[3], values[0], values[1], values[2]).normalized();
  pose.center_camera_mm = Vector3d(values[4], values[5], values[6]);
  return pose;
}

ObjectPose object_pose(const RigidTransform& camera_from_world, const Vector3d& center_world_mm) {
  return {Quaterniond(camera_from_world.rotation).normalized(),
          camera_from_world * center_world_mm};
}

RigidTransform rigid_transform(const ObjectPose& pose, const Vector3d& center_world_mm) {
  RigidTransform transform;
  transform.rotation = pose.camera_from_world.toRotationMatrix();
  transform.translation = pose.center_camera_mm - transform.rotation * center_world_mm;
  return transform;
}

ObjectPose moved(const ObjectPose& pose, const Motion& motion) {
  return {(exponential(motion.head<3>()) * pose.camera_from_world).normalized(),
          pose.center_camera_mm + motion.tail<3>()};
}

Motion motion_between(const ObjectPose& from, const ObjectPose& to) {
  const Eigen::AngleAxisd turn(to.camera_from_world * from.camera_from_world.conjugate());
  double angle = turn.angle();
  if (angle > M_PI) angle -= 2 * M_PI;
  Motion motion;
  motion << angle * turn.axis(), to.center_camera_mm - from.center_camera_mm;
  return motion;
}

Eigen::Matrix<double, 2, 3> projection_jacobian(const Intrinsics& k, const Vector3d& p) {
  const double x = p.x() / p.z(), y = p.y() / p.z();
  Eigen::Matrix<double, 2, 3> normalised;
  normalised << 1 / p.z(), 0, -x / p.z(), 0, 1 / p.z(), -y / p.z();
  Eigen::Matrix2d lens = Eigen::Matrix2d::Identity();
  if (k.has_distortion()) {
    const double r2 = x * x + y * y;
    const double radial = 1 + r2 * (k.k1 + r2 * (k.k2 + r2 * k.k3));
    const double slope = 2 * (k.k1 + r2 * (2 * k.k2 + 3 * r2 * k.k3));  // d radial / d(r²), twice
    lens(0, 0) = radial + slope * x * x + 2 * k.p1 * y + 6 * k.p2 * x;
    lens(0, 1) = slope * x * y + 2 * k.p1 * x + 2 * k.p2 * y;
    lens(1, 0) = lens(0, 1);
    lens(1, 1) = radial + slope * y * y + 6 * k.p1 * y + 2 * k.p2 * x;
  }
  return Eigen::Vector2d(k.fx, k.fy).asDiagonal() * lens * normalised;
}

Eigen::Matrix<double, 2, 6> pixel_motion(const Intrinsics& intrinsics, const Vector3d& point,
                                         const Vector3d& center) {
  const Eigen::Matrix<double, 2, 3> projection = projection_jacobian(intrinsics, point);
  Eigen::Matrix<double, 2, 6> motion;
  motion << -projection * cross_matrix(point - center), projection;
  return motion;
}

Intrinsics reduced(const Intrinsics& intrinsics, int factor) {
  Intrinsics small = intrinsics;
  small.width = intrinsics.width / factor;
  small.height = intrinsics.height / factor;
  small.fx /= factor;
  small.fy /= factor;
  small.cx /= factor;
  small.cy /= factor;
  return small;
}

// A pose from point pairs, clicked by hand: most of those that one pose explains (RANSAC), then the
// best for them all (Terzakis & Lourakis, SQPnP, 2020).
RigidTransform pose_from_pairs(const std::vector<PointPair>& pairs, const Intrinsics& lens) {
  constexpr std::size_t kFewest = 6;
  if (pairs.size() < kFewest) {
    throw UsageError("point pairs: " + std::to_string(pairs.size()) + " given, at least " +
                     std::to_string(kFewest) + " fix a pose");
  }
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> rays;  // of a lens with the focal length 1
  Eigen::Matrix3Xd places(3, pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Vector3d& place = pairs[i].point_world_mm;
    const Vector3d ray = unproject(lens, pairs[i].pixel);
    points.emplace_back(place.x(), place.y(), place.z());
    rays.emplace_back(ray.x(), ray.y());
    places.col(static_cast<Eigen::Index>(i)) = place;
  }
  places.colwise() -= places.rowwise().mean().eval();
  const Vector3d extents = places.jacobiSvd().singularValues();
  constexpr double kFlat = 1e-6, kMisclicked_px = 8, kSure = 0.999;
  constexpr int kTries = 100;
  cv::Vec3d turn, shift;
  if (!(extents[2] > kFlat * extents[0]) ||
      !cv::solvePnPRansac(points, rays, cv::Matx33d::eye(), cv::noArray(), turn, shift, false,
                          kTries, kMisclicked_px / lens.fx, kSure, cv::noArray(),
                          cv::SOLVEPNP_SQPNP)) {
    throw UsageError("the point pairs do not fix a pose: take points that do not lie in one plane");
  }
  cv::Matx33d rotation;
  cv::Rodrigues(turn, rotation);
  return {Eigen::Matrix<double, 3, 3, Eigen::RowMajor>::Map(rotation.val),
          Vector3d::Map(shift.val)};
}

}  // namespace organbake
