// SPDX-License-Identifier: GPL-3.0-or-later
// A pose from point pairs: the direct linear transform with normalised coordinates (Hartley &
// Zisserman, Multiple View Geometry, 7.1), then robust least squares of the pixels.
#include "pose/point_pairs.h"

#include <ceres/ceres.h>

#include <Eigen/SVD>
#include <opencv2/core.hpp>

#include "cost_functions/pose_manifold.h"
#include "organbake/core/error.h"

namespace organbake {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
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
