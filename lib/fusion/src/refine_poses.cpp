// SPDX-License-Identifier: GPL-3.0-or-later
// Cameras moved until the views' surfaces agree: point to plane (Chen & Medioni 1992), all views at
// once, Gauss–Newton steps with a robust weight, each camera held where it was given.
#include "organbake/fusion/fuse_views.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include "organbake/core/parallel.h"
#include "organbake/geometry/dense_solve.h"

namespace organbake {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Eigen::Vector3d;

constexpr int kPointsAcross = 56;  // of a view, in each direction
constexpr double kRobust = 2.5;    // of the spread, beyond which a distance counts less
constexpr int kMostRounds = 30;
// How far off cameras are given, standard deviations.
constexpr double kPlaceSd_mm = 1, kAngleSd_rad = 0.018;

// What the points of one view say: rows of its own motion and of the view that sees them.
struct PairTerms {
  Eigen::Matrix<double, 12, 12> h = Eigen::Matrix<double, 12, 12>::Zero();
  Eigen::Matrix<double, 12, 1> g = Eigen::Matrix<double, 12, 1>::Zero();
  double sum = 0, count = 0;
};

// A motion of the world as the camera has it: small turn and shift about `pivot`.
Vector6d row_of(const Vector3d& point, const Vector3d& pivot, const Vector3d& normal) {
  Vector6d row;
  row << (point - pivot).cross(normal), normal;
  return row;
}

// Points of view a against the surface of view b; distances beyond `reach_mm` are other surfaces.
PairTerms terms_of(const SmoothView& a, const SmoothView& b, const Vector3d& pivot_a,
                   const Vector3d& pivot_b, double reach_mm, double spread_mm) {
  PairTerms terms;
  const int step = std::max(1, std::max(a.depth_mm.width, a.depth_mm.height) / kPointsAcross);
  const Eigen::Matrix3d world_from_b = b.camera.camera_from_world.rotation.transpose();
  for (int y = step / 2; y < a.depth_mm.height; y += step)
    for (int x = step / 2; x < a.depth_mm.width; x += step) {
      const double weight_a = a.weight.at(x, y);
      if (!(weight_a > 0)) continue;
      const Vector3d point = a.point_world_mm(x, y);
      const SeenSurface seen = seen_at(b, point);
      if (!(seen.weight > 0) || !is_same_side(b, seen, a.normal_world(x, y))) continue;
      const Vector3d normal = world_from_b * seen.normal_camera;
      // Along the ray the surface is off by Δz; along its normal by that times the cosine.
      const Vector3d ray = (b.camera.camera_from_world * point) / seen.point_z_mm;
      const double off = (seen.point_z_mm - seen.depth_mm) * ray.dot(seen.normal_camera);
      if (std::abs(off) > reach_mm) continue;
      const double beyond = off / (kRobust * spread_mm);
      const double weight = weight_a * seen.weight / (1 + beyond * beyond);
      Eigen::Matrix<double, 12, 1> row;
      row << row_of(point, pivot_a, normal), -row_of(point, pivot_b, normal);
      terms.h += weight * row * row.transpose();
      terms.g += weight * off * row;
      terms.sum += weight * off * off;
      terms.count += weight;
    }
  return terms;
}

// Moves what a view shows by a small motion of the world about a pivot.
void move(SmoothView& view, const Vector6d& step, const Vector3d& pivot) {
  const Vector3d turn = step.head<3>();
  const double angle = turn.norm();
  const Eigen::Matrix3d rotation = angle > 0
                                       ? Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix()
                                       : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  const RigidTransform world_motion{rotation, pivot + Vector3d(step.tail<3>()) - rotation * pivot};
  view.camera.camera_from_world = view.camera.camera_from_world * world_motion.inverse();
}

// Turn and shift of a camera from where it was given, about its centre there.
Vector6d motion_from(const RigidTransform& given, const RigidTransform& now) {
  const RigidTransform motion = now.inverse() * given;  // of the world, as the view shows it
  const Eigen::AngleAxisd turn(motion.rotation);
  Vector6d result;
  const Vector3d centre = given.inverse().translation;
  result << turn.angle() * turn.axis(), motion * centre - centre;
  return result;
}

class Refiner {
 public:
  explicit Refiner(std::vector<SmoothView>& views) : views_(views) {
    for (const SmoothView& view : views) {
      given_.push_back(view.camera.camera_from_world);
      pivots_.push_back(view.camera.center_world_mm());
    }
  }

  RefinedPoses run(bool moving) {
    RefinedPoses result;
    double reach_mm = 8 * kPlaceSd_mm + 4 * usual_noise(), spread_mm = reach_mm / 3;
    for (; result.rounds < kMostRounds; ++result.rounds) {
      const double moved = round(reach_mm, spread_mm, moving);
      const double off_mm = count_ > 0 ? std::sqrt(sum_ / count_) : 0;
      if (result.rounds == 0) result.before_mm = off_mm;
      result.after_mm = off_mm;
      spread_mm = std::max(0.1, off_mm);
      // Narrower step by step: what a camera is off by may be more than most points show.
      reach_mm = std::min(reach_mm, std::max({6 * spread_mm, 0.8 * reach_mm, 1.0}));
      constexpr double kStill_mm = 2e-3;
      constexpr int kMostStill = 12;  // while the reach narrows
      if (moving ? moved < kStill_mm : result.rounds >= kMostStill) break;
    }
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const Vector6d motion = motion_from(given_[i], views_[i].camera.camera_from_world);
      result.turned_rad = std::max(result.turned_rad, motion.head<3>().norm());
      result.moved_mm = std::max(result.moved_mm, motion.tail<3>().norm());
    }
    return result;
  }

 private:
  double usual_noise() const {
    double most = 0;
    for (const SmoothView& view : views_) most = std::max(most, view.noise_mm);
    return most;
  }

  // One step of all views; returns the largest shift or turn (at 100 mm), mm.
  double round(double reach_mm, double spread_mm, bool moving) {
    const int count = static_cast<int>(views_.size());
    std::vector<PairTerms> pairs(std::size_t(count) * count);
    parallel_for(0, count * count, [&](int pair) {
      const int a = pair / count, b = pair % count;
      if (a != b)
        pairs[pair] = terms_of(views_[a], views_[b], pivots_[a], pivots_[b], reach_mm, spread_mm);
    });
    Eigen::MatrixXd h = Eigen::MatrixXd::Zero(6 * count, 6 * count);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(6 * count);
    sum_ = count_ = 0;
    for (int a = 0; a < count; ++a)
      for (int b = 0; b < count; ++b) {
        const PairTerms& t = pairs[a * count + b];
        h.block<6, 6>(6 * a, 6 * a) += t.h.topLeftCorner<6, 6>();
        h.block<6, 6>(6 * a, 6 * b) += t.h.topRightCorner<6, 6>();
        h.block<6, 6>(6 * b, 6 * a) += t.h.bottomLeftCorner<6, 6>();
        h.block<6, 6>(6 * b, 6 * b) += t.h.bottomRightCorner<6, 6>();
        g.segment<6>(6 * a) += t.g.head<6>();
        g.segment<6>(6 * b) += t.g.tail<6>();
        sum_ += t.sum;
        count_ += t.count;
      }
    if (!moving) return 0;
    hold(spread_mm, h, g);
    const Eigen::VectorXd step = -solve_symmetric(h, g);
    double largest = 0;
    for (int i = 0; i < count; ++i) {
      const Vector6d own = step.segment<6>(6 * i);
      constexpr double kArm_mm = 100;
      largest = std::max({largest, kArm_mm * own.head<3>().norm(), own.tail<3>().norm()});
      move(views_[i], own, pivots_[i]);
    }
    return largest;
  }

  // Each view stays where it was given as firmly as that is likely. Its many points err together
  // (a depth map is smooth): they count as few.
  void hold(double spread_mm, Eigen::MatrixXd& h, Eigen::VectorXd& g) const {
    constexpr double kPointsThatErrAlone = 50;
    const double scale = std::max(1e-12, count_) / static_cast<double>(views_.size());
    const double unit = scale / kPointsThatErrAlone * spread_mm * spread_mm;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const Vector6d motion = motion_from(given_[i], views_[i].camera.camera_from_world);
      for (int k = 0; k < 6; ++k) {
        const double sd = k < 3 ? kAngleSd_rad : kPlaceSd_mm;
        const auto at = static_cast<Eigen::Index>(6 * i) + k;
        h(at, at) += unit / (sd * sd);
        g(at) += unit / (sd * sd) * motion[k];
      }
    }
  }

  std::vector<SmoothView>& views_;
  std::vector<RigidTransform> given_;
  std::vector<Vector3d> pivots_;
  double sum_ = 0, count_ = 0;
};

}  // namespace

RefinedPoses refine_poses(std::vector<SmoothView>& views) {
  if (views.size() < 2) return {};
  return Refiner(views).run(true);
}

double views_apart_mm(std::vector<SmoothView> views) {
  if (views.size() < 2) return 0;
  return Refiner(views).run(false).after_mm;
}

}  // namespace organbake
