// SPDX-License-Identifier: GPL-3.0-or-later
// A pose as the solver moves it, about the object's own centre, with its derivatives in the
// picture; and a first one from point pairs (the direct linear transform).
#include "organbake/registration/object_pose.h"

#include <ceres/ceres.h>
#include <Eigen/SVD>
#include <cmath>
#include <opencv2/core.hpp>

#include "cost_functions/cost_functions.h"
#include "organbake/core/error.h"
#include "pose/poses.h"

namespace organbake {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Quaterniond exponential(const Vector3d& rotation) {
  const double angle = rotation.norm();
  constexpr double kTiny = 1e-12;
  if (angle < kTiny) {
    return Quaterniond(1, rotation.x() / 2, rotation.y() / 2, rotation.z() / 2).normalized();
  }
  return Quaterniond(Eigen::AngleAxisd(angle, rotation / angle));
}

Matrix3d cross_matrix(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

using Projection = Eigen::Matrix<double, 3, 4>;

constexpr std::size_t kFewest = 6;

class PixelError : public ceres::SizedCostFunction<2, 7> {
 public:
  PixelError(const PointPair& pair, const Intrinsics& lens, const Vector3d& center)
      : from_center_(pair.point_world_mm - center), pixel_(pair.pixel), lens_(lens) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const ObjectPose pose = ObjectPose::from_array(parameters[0]);
    const Vector3d x = pose.camera_from_world * from_center_ + pose.center_camera_mm;
    if (!(x.z() > 0)) return false;
    Eigen::Vector2d::Map(residuals) = project(lens_, x) - pixel_;
    if (jacobians && jacobians[0]) {
      Eigen::Matrix<double, 2, 7, Eigen::RowMajor>::Map(jacobians[0]) =
          pixel_motion(lens_, x, pose.center_camera_mm) *
          PoseManifold::minus_jacobian(parameters[0]);
    }
    return true;
  }

 private:
  Vector3d from_center_;
  Eigen::Vector2d pixel_;
  Intrinsics lens_;
};

[[noreturn]] void refuse_degenerate() {
  throw UsageError("the point pairs do not fix a pose: take points that do not lie in one plane");
}

// P with ray × P (X, 1) = 0 for all pairs, points scaled to about unit size.
Projection direct_linear_transform(const std::vector<PointPair>& pairs, const Intrinsics& lens,
                                   const Vector3d& center, double size) {
  cv::Mat_<double> a(static_cast<int>(2 * pairs.size()), 12);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Vector3d ray = unproject(lens, pairs[i].pixel);
    Eigen::RowVector4d point;
    point << ((pairs[i].point_world_mm - center) / size).transpose(), 1;
    using TwoRows = Eigen::Matrix<double, 2, 12, Eigen::RowMajor>;
    TwoRows::Map(a[static_cast<int>(2 * i)]) << point, Eigen::RowVector4d::Zero(), -ray.x() * point,
        Eigen::RowVector4d::Zero(), point, -ray.y() * point;
  }
  const cv::SVD svd(a);
  constexpr double kDegenerate = 1e-6;
  if (svd.w.at<double>(10) < kDegenerate * svd.w.at<double>(0)) refuse_degenerate();
  return Eigen::Matrix<double, 3, 4, Eigen::RowMajor>::Map(svd.vt.ptr<double>(11));
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

// A pose from point pairs: the direct linear transform with normalised coordinates (Hartley &
// Zisserman, Multiple View Geometry, 7.1), then robust least squares of the pixels.

RigidTransform pose_from_pairs(const std::vector<PointPair>& pairs, const Intrinsics& lens) {
  if (pairs.size() < kFewest) {
    throw UsageError("point pairs: " + std::to_string(pairs.size()) + " given, at least " +
                     std::to_string(kFewest) + " fix a pose");
  }
  Vector3d center = Vector3d::Zero();
  for (const PointPair& pair : pairs) center += pair.point_world_mm / pairs.size();
  double size = 0;
  for (const PointPair& pair : pairs) size = std::max(size, (pair.point_world_mm - center).norm());
  if (!(size > 0)) refuse_degenerate();
  Projection p = direct_linear_transform(pairs, lens, center, size);
  if (p.leftCols<3>().determinant() < 0) p = -p;
  const Eigen::JacobiSVD<Matrix3d> svd(p.leftCols<3>(), Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double scale = svd.singularValues().mean();
  ObjectPose pose;
  pose.camera_from_world = Eigen::Quaterniond(Matrix3d(svd.matrixU() * svd.matrixV().transpose()));
  pose.center_camera_mm = size * p.col(3) / scale;
  if (!(pose.center_camera_mm.z() > 0)) refuse_degenerate();

  std::array<double, 7> values = pose.to_array();
  PoseManifold manifold;
  ceres::Problem::Options problem_options;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  problem.AddParameterBlock(values.data(), 7, &manifold);
  constexpr double kClickingPx = 3;
  for (const PointPair& pair : pairs)
    problem.AddResidualBlock(new PixelError(pair, lens, center), new ceres::CauchyLoss(kClickingPx),
                             values.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return rigid_transform(ObjectPose::from_array(values.data()), center);
}

}  // namespace organbake
