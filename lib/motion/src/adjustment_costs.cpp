// SPDX-License-Identifier: GPL-3.0-or-later
//
// What bundle adjustment makes small: how far sightings lie from where rigid or breathing tissue
// would be seen, with the slopes by hand: differences of the whole by Ceres' jets take ten times as
// long. And, where tissue breathes, how the scope's way bends.
#include "adjustment_costs.h"

#include <ceres/rotation.h>
#include <algorithm>
#include <cmath>

namespace organbake {
namespace {

// exp(w), and how fast what it turns moves with w: d(exp(w)·a)/dw = −[exp(w)·a]× · left.
struct Turned {
  Eigen::Matrix3d rotation, left;
  explicit Turned(const Eigen::Vector3d& w) {
    const double angle = w.norm();
    Eigen::Matrix3d cross;
    cross << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
    constexpr double kTiny = 1e-8;
    const double square = angle * angle;
    const double a = angle < kTiny ? 1 : std::sin(angle) / angle;
    const double b = angle < kTiny ? 0.5 : (1 - std::cos(angle)) / square;
    const double c = angle < kTiny ? 1.0 / 6 : (1 - a) / square;
    rotation = Eigen::Matrix3d::Identity() + a * cross + b * cross * cross;
    left = Eigen::Matrix3d::Identity() + b * cross + c * cross * cross;
  }
};

class BreathingCost
    : public ceres::SizedCostFunction<2, kOfPose, kOfPlace, kOfLens, kOfCourse, kOfField> {
 public:
  BreathingCost(const Eigen::Vector2d& pixel, const Intrinsics& lens, double time,
                const Breath::Terms& terms)
      : rigid_(pixel, lens), time_(time), terms_(terms) {}

  bool Evaluate(const double* const* blocks, double* error, double** slopes) const override {
    const Eigen::Map<const Breath::Waves> heights(blocks[3]);
    const Breath::Waves waves = Breath::waves_at(blocks[3][Breath::kWaves] * time_);
    const Eigen::Vector3d push = Eigen::Map<const Breath::Field>(blocks[4]) * terms_;
    const double course = waves.dot(heights);
    const Eigen::Vector3d there = Eigen::Map<const Eigen::Vector3d>(blocks[1]) + course * push;
    const double* rigid[] = {blocks[0], there.data(), blocks[2]};
    if (!slopes) return rigid_.Evaluate(rigid, error, nullptr);
    Eigen::Matrix<double, 2, 3, Eigen::RowMajor> by_place;
    double* of_rigid[] = {slopes[0], by_place.data(), slopes[2]};
    if (!rigid_.Evaluate(rigid, error, of_rigid)) return false;
    if (slopes[1]) std::copy_n(by_place.data(), by_place.size(), slopes[1]);
    if (slopes[3]) {
      Eigen::Matrix<double, 1, kOfCourse> by_course;
      by_course << waves.transpose(), time_ * (heights[1] * waves[0] - heights[0] * waves[1] +
                                               2 * (heights[3] * waves[2] - heights[2] * waves[3]));
      Eigen::Map<Eigen::Matrix<double, 2, kOfCourse, Eigen::RowMajor>>{slopes[3]} =
          by_place * push * by_course;
    }
    if (slopes[4]) {
      Eigen::Map<Eigen::Matrix<double, 2, kOfField, Eigen::RowMajor>> by_field(slopes[4]);
      for (int k = 0; k < Breath::kTerms; ++k)
        by_field.middleCols<3>(3 * k) = course * terms_[k] * by_place;
    }
    return true;
  }

 private:
  SightingCost rigid_;
  double time_;  // frames
  Breath::Terms terms_;
};

struct EvenWay {
  double time, depth, weight_px;

  template <typename T>
  bool operator()(const T* before, const T* now, const T* after, T* bend) const {
    for (int point = 0; point < 3; ++point) {
      const double ahead[3] = {point == 1 ? depth : 0, 0, point == 2 ? depth : 0};
      T* out = bend + 3 * point;
      std::fill_n(out, 3, T(0));
      const std::pair<const T*, double> parts[] = {{before, time - 1}, {now, 1}, {after, -time}};
      for (const auto& [pose, share] : parts) {
        const T back[3] = {-pose[0], -pose[1], -pose[2]};
        const T from_camera[3] = {ahead[0] - pose[3], ahead[1] - pose[4], ahead[2] - pose[5]};
        T there[3];
        ceres::AngleAxisRotatePoint(back, from_camera, there);
        for (int axis = 0; axis < 3; ++axis) out[axis] += weight_px / depth * share * there[axis];
      }
    }
    return true;
  }
};

}  // namespace

Eigen::Matrix<double, 2, 3> pixel_slopes(const Intrinsics& lens, const Eigen::Vector3d& point) {
  constexpr double kStep = 1e-6;
  const double x = point.x() / point.z(), y = point.y() / point.z();
  const Eigen::Vector3d ray(x, y, 1);
  const auto along = [&](const Eigen::Vector3d& axis) -> Eigen::Vector2d {
    return (project(lens, ray + kStep * axis) - project(lens, ray - kStep * axis)) / (2 * kStep);
  };
  const Eigen::Vector2d along_x = along(Eigen::Vector3d::UnitX()),
                        along_y = along(Eigen::Vector3d::UnitY());
  Eigen::Matrix<double, 2, 3> slopes;
  slopes << along_x, along_y, -x * along_x - y * along_y;
  return slopes / point.z();
}

Intrinsics with_free(Intrinsics lens, const double* free) {
  lens.fy *= free[0] / lens.fx;
  lens.fx = free[0];
  lens.k1 = free[1];
  return lens;
}

bool SightingCost::Evaluate(const double* const* blocks, double* error, double** slopes) const {
  const Eigen::Map<const Eigen::Vector3d> w(blocks[0]), translation(blocks[0] + 3),
      place(blocks[1]);
  const Turned turned(w);
  const Eigen::Vector3d arm = turned.rotation * (place + pushed_), point = arm + translation;
  if (!(point.z() > kNearest)) return false;
  const Intrinsics lens = with_free(lens_, blocks[2]);
  const Eigen::Vector2d seen = project(lens, point);
  Eigen::Map<Eigen::Vector2d>{error} = seen - pixel_;
  if (!slopes) return true;
  const Eigen::Matrix<double, 2, 3> by_point = pixel_slopes(lens, point);
  if (slopes[0]) {
    Eigen::Matrix3d cross;
    cross << 0, -arm.z(), arm.y(), arm.z(), 0, -arm.x(), -arm.y(), arm.x(), 0;
    Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> by_pose(slopes[0]);
    by_pose << -by_point * cross * turned.left, by_point;
  }
  if (slopes[1])
    Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>{slopes[1]} =
        by_point * turned.rotation;
  if (slopes[2]) {
    const double x = point.x() / point.z(), y = point.y() / point.z(), r2 = x * x + y * y;
    Eigen::Map<Eigen::Matrix<double, 2, 2, Eigen::RowMajor>>{slopes[2]}
        << (seen.x() - lens.cx) / lens.fx,
        lens.fx * x * r2, (seen.y() - lens.cy) / lens.fx, lens.fy * y * r2;
  }
  return true;
}

ceres::CostFunction* breathing_cost(const Eigen::Vector2d& pixel, const Intrinsics& lens,
                                    double time_frames, const Breath::Terms& terms) {
  return new BreathingCost(pixel, lens, time_frames, terms);
}

ceres::CostFunction* even_way_cost(double time, double depth, double weight_px) {
  return new ceres::AutoDiffCostFunction<EvenWay, 9, kOfPose, kOfPose, kOfPose>(
      new EvenWay{time, depth, weight_px});
}

}  // namespace organbake
