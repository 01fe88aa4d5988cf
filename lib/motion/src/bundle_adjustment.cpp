// SPDX-License-Identifier: GPL-3.0-or-later
//
// Poses, places and lens moved together until the sightings that agree lie where the places are
// seen: bundle adjustment (Triggs et al. 2000) by Ceres' sparse Schur complement, robustly
// (Cauchy). In: a scene with sightings, and what of its lens is free. Out: the same scene, moved;
// and how a sighting's error bends there, by which a lens is doubted (lens_doubt.cpp).
#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "organbake/motion/scene.h"
#include "two_views.h"

namespace organbake {
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

namespace {

// Angle and axis, then the translation.
using PoseBlock = std::array<double, 6>;
// Focal length, k1.
using LensBlock = std::array<double, 2>;

PoseBlock block_of(const RigidTransform& pose) {
  PoseBlock block;
  const Eigen::Matrix3d& r = pose.rotation;
  ceres::RotationMatrixToAngleAxis(r.data(), block.data());
  std::copy_n(pose.translation.data(), 3, block.data() + 3);
  return block;
}

RigidTransform pose_of(const PoseBlock& block) {
  RigidTransform pose;
  ceres::AngleAxisToRotationMatrix(block.data(), pose.rotation.data());
  std::copy_n(block.data() + 3, 3, pose.translation.data());
  return pose;
}

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

Intrinsics with_free(Intrinsics lens, const double* free) {
  lens.fy *= free[0] / lens.fx;
  lens.fx = free[0];
  lens.k1 = free[1];
  return lens;
}

constexpr double kNearest = 1e-9;  // before a camera

// A sighting from behind is no sighting: no step leads from there, and one such would end all.
bool is_before(const RigidTransform& camera_from_world, const Eigen::Vector3d& place) {
  return (camera_from_world * place).z() > kNearest;
}

// Pixels from a sighting to its landmark's place. By hand: differences of the whole by Ceres' jets
// take ten times as long.
class SightingCost : public ceres::SizedCostFunction<2, 6, 3, 2> {
 public:
  SightingCost(const Eigen::Vector2d& pixel, const Intrinsics& lens,
               const Eigen::Vector3d& pushed = Eigen::Vector3d::Zero())
      : pixel_(pixel), lens_(lens), pushed_(pushed) {}

  bool Evaluate(const double* const* blocks, double* error, double** slopes) const override {
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

 private:
  Eigen::Vector2d pixel_;
  const Intrinsics& lens_;  // its focal length and k1 aside
  Eigen::Vector3d pushed_;  // what is added to the place
};

// Waves of a breath, then its radians per frame.
constexpr int kOfCourse = Breath::kWaves + 1, kOfField = 3 * Breath::kTerms;
using CourseBlock = std::array<double, kOfCourse>;

// The same where tissue breathes: place + course(time) · field(place). The field's terms are taken
// where the place was.
class BreathingCost : public ceres::SizedCostFunction<2, 6, 3, 2, kOfCourse, kOfField> {
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

// What all tissue does alike the scope may do as well, and sightings do not tell which. A hand does
// not breathe: of all these ways the scope goes the one that bends the least between what is a
// third of a breath before and after. Pixels, of the scope and of what lies ahead and beside it.
struct EvenWay {
  double time, depth, weight_px;  // time: of the view, 0 before, 1 after

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

constexpr double kRobust_px = 1;  // beyond which an error counts less (Cauchy)

ceres::Problem::Options caller_owns_loss() {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

// One thread: sums come in one order.
void solve(ceres::LinearSolverType type, int iterations, double tolerance,
           ceres::Problem& problem) {
  ceres::Solver::Options options;
  options.linear_solver_type = type;
  options.max_num_iterations = iterations;
  options.function_tolerance = tolerance;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
}

class Adjustment {
 public:
  Adjustment(const AdjustmentOptions& options, Scene& scene)
      : options_(options),
        scene_(scene),
        robust_(options.robust_px),
        problem_(caller_owns_loss()),
        lens_{scene.lens.fx, scene.lens.k1},
        poses_(scene.camera_from_world.size()),
        taken_(poses_.size(), 0) {
    for (std::size_t view = 0; view < poses_.size(); ++view)
      if (scene.is_posed(view)) poses_[view] = block_of(*scene.camera_from_world[view]);
    if (!options.breath) return;
    std::copy_n(options.breath->waves.data(), Breath::kWaves, course_.data());
    course_.back() = 2 * std::numbers::pi / options.breath->period_frames;
  }

  void run() {
    add_sightings();
    if (problem_.NumResidualBlocks() == 0) return;
    hold_lens();
    hold_poses();
    if (options_.breath) add_breath();
    if (!scene_.breath.empty()) hold_size();
    solve(ceres::SPARSE_SCHUR, options_.iterations, options_.tolerance, problem_);
    keep_result();
  }

 private:
  bool moves(std::size_t view) const { return options_.moving.empty() || options_.moving[view]; }

  // The longest tracks first, until every view has its share.
  void add_sightings() {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < scene_.landmarks.size(); ++i)
      if (scene_.landmarks[i].place) order.push_back(i);
    if (options_.sightings_per_view > 0)
      std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return scene_.landmarks[a].seen.size() > scene_.landmarks[b].seen.size();
      });
    for (const std::size_t i : order)
      if (is_wanted(scene_.landmarks[i])) add(scene_.landmarks[i]);
  }

  bool is_wanted(const Landmark& landmark) const {
    bool moved = false, missing = options_.sightings_per_view == 0;
    for (const Sighting& sighting : landmark.seen) {
      if (!sighting.agrees || !scene_.is_posed(sighting.view)) continue;
      moved = moved || moves(sighting.view);
      missing = missing || taken_[sighting.view] < options_.sightings_per_view;
    }
    return moved && missing;
  }

  void add(Landmark& landmark) {
    for (const Sighting& sighting : landmark.seen) {
      if (!sighting.agrees || !scene_.is_posed(sighting.view)) continue;
      const Eigen::Vector3d place = scene_.place_in(sighting.view, landmark);
      if (!is_before(*scene_.camera_from_world[sighting.view], place)) continue;
      ++taken_[sighting.view];
      double *pose = poses_[sighting.view].data(), *at_rest = landmark.place->data();
      if (Breath* breath = options_.breath)
        problem_.AddResidualBlock(
            new BreathingCost(sighting.pixel, scene_.lens, breath->time_of(sighting.view),
                              breath->terms_at(*landmark.place)),
            &robust_, pose, at_rest, lens_.data(), course_.data(), breath->field.data());
      else
        problem_.AddResidualBlock(
            new SightingCost(sighting.pixel, scene_.lens, place - *landmark.place), &robust_, pose,
            at_rest, lens_.data());
    }
  }

  // The course keeps its size, which the field could take over.
  void add_breath() {
    constexpr double kWeight_px = 0.1;  // of the focal length
    const Breath& breath = *options_.breath;
    Eigen::Index largest = 0;
    breath.waves.cwiseAbs().maxCoeff(&largest);
    problem_.SetManifold(course_.data(),
                         new ceres::SubsetManifold(kOfCourse, {static_cast<int>(largest)}));
    const std::vector<std::size_t> views = moved_views();
    const double third = breath.period_frames / 3;
    for (const std::size_t view : views) {
      const double now = breath.time_of(view);
      const auto after = std::ranges::find_if(
          views, [&](std::size_t other) { return breath.time_of(other) >= now + third; });
      const auto before = std::find_if(views.rbegin(), views.rend(), [&](std::size_t other) {
        return breath.time_of(other) <= now - third;
      });
      if (after == views.end() || before == views.rend()) continue;
      const double start = breath.time_of(*before);
      problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<EvenWay, 9, 6, 6, 6>(
                                    new EvenWay{(now - start) / (breath.time_of(*after) - start),
                                                breath.depth, kWeight_px * scene_.lens.fx}),
                                nullptr, poses_[*before].data(), poses_[view].data(),
                                poses_[*after].data());
    }
  }

  std::vector<std::size_t> moved_views() const {
    std::vector<std::size_t> views;
    for (std::size_t view = 0; view < poses_.size(); ++view)
      if (problem_.HasParameterBlock(poses_[view].data())) views.push_back(view);
    return views;
  }

  // A scene that shrinks and its breath does not: the scope would breathe in its place.
  void hold_size() {
    const std::vector<std::size_t> views = moved_views();
    const auto from_first = [&](std::size_t view) -> Eigen::Vector3d {
      return *scene_.camera_from_world[view] *
             scene_.camera_from_world[views.front()]->inverse().translation;
    };
    const std::size_t farthest = *std::ranges::max_element(
        views, {}, [&](std::size_t view) { return from_first(view).norm(); });
    Eigen::Index axis = 0;
    from_first(farthest).cwiseAbs().maxCoeff(&axis);
    problem_.SetManifold(poses_[farthest].data(),
                         new ceres::SubsetManifold(kOfPose, {3 + static_cast<int>(axis)}));
  }

  void hold_lens() {
    const FreeLens& free = options_.lens;
    if (!free.focal && !free.distortion) return problem_.SetParameterBlockConstant(lens_.data());
    if (!free.focal || !free.distortion)
      problem_.SetManifold(lens_.data(), new ceres::SubsetManifold(2, {free.focal ? 1 : 0}));
  }

  void hold_poses() {
    bool held = false;
    for (std::size_t view = 0; view < poses_.size(); ++view) {
      if (!problem_.HasParameterBlock(poses_[view].data())) continue;
      if (moves(view) && held) continue;
      if (moves(view)) held = true;
      problem_.SetParameterBlockConstant(poses_[view].data());
    }
  }

  void keep_result() {
    for (std::size_t view = 0; view < poses_.size(); ++view)
      if (problem_.HasParameterBlock(poses_[view].data()))
        scene_.camera_from_world[view] = pose_of(poses_[view]);
    scene_.lens = with_free(scene_.lens, lens_.data());
    if (!options_.breath) return;
    std::copy_n(course_.data(), Breath::kWaves, options_.breath->waves.data());
    options_.breath->period_frames = 2 * std::numbers::pi / course_.back();
  }

  const AdjustmentOptions& options_;
  Scene& scene_;
  ceres::CauchyLoss robust_;
  ceres::Problem problem_;
  LensBlock lens_;
  CourseBlock course_ = {};
  std::vector<PoseBlock> poses_;
  std::vector<std::size_t> taken_;  // sightings of each view
};

}  // namespace

void adjust(const AdjustmentOptions& options, Scene& scene) { Adjustment(options, scene).run(); }

std::size_t adjust_pose(const Intrinsics& lens, const SeenPlaces& seen,
                        RigidTransform& camera_from_world) {
  constexpr int kIterations = 15;
  constexpr double kTolerance = 1e-6, kAgrees_px = 4;
  ceres::CauchyLoss robust(kRobust_px);
  ceres::Problem problem(caller_owns_loss());
  PoseBlock pose = block_of(camera_from_world);
  LensBlock free{lens.fx, lens.k1};
  std::vector<Eigen::Vector3d> held = seen.places;
  for (std::size_t i = 0; i < held.size(); ++i) {
    if (!is_before(camera_from_world, held[i])) continue;
    problem.AddResidualBlock(new SightingCost(seen.pixels[i], lens), &robust, pose.data(),
                             held[i].data(), free.data());
    problem.SetParameterBlockConstant(held[i].data());
  }
  if (problem.NumResidualBlocks() == 0) return 0;
  problem.SetParameterBlockConstant(free.data());
  solve(ceres::DENSE_QR, kIterations, kTolerance, problem);
  camera_from_world = pose_of(pose);
  std::size_t agreeing = 0;
  for (std::size_t i = 0; i < held.size(); ++i) {
    const Eigen::Vector3d point = camera_from_world * held[i];
    agreeing += point.z() > 0 && (project(lens, point) - seen.pixels[i]).norm() <= kAgrees_px;
  }
  return agreeing;
}

bool WeighedSighting::weigh(const Sighting& seen, const Landmark& landmark, const FreeLens& free,
                            const Scene& scene) {
  const PoseBlock pose = block_of(*scene.camera_from_world[seen.view]);
  const LensBlock lens{scene.lens.fx, scene.lens.k1};
  const double* blocks[] = {pose.data(), landmark.place->data(), lens.data()};
  double* slopes[] = {by_pose.data(), by_place.data(), by_lens.data()};
  const Eigen::Vector3d pushed = scene.place_in(seen.view, landmark) - *landmark.place;
  if (!SightingCost(seen.pixel, scene.lens, pushed).Evaluate(blocks, error.data(), slopes))
    return false;
  if (!free.focal) by_lens.col(0).setZero();
  if (!free.distortion) by_lens.col(1).setZero();
  // An outlier's curvature along its error would be negative: it is taken for nearly none.
  constexpr double kMostBent = 0.9;
  const double square = error.squaredNorm() / (kRobust_px * kRobust_px);
  const double weight = 1 / (1 + square), bent = std::min(kMostBent, 2 * square * weight);
  const Eigen::Vector2d along = error / std::max(1e-12, error.norm());
  const Eigen::Matrix2d root =
      std::sqrt(weight) *
      (Eigen::Matrix2d::Identity() - (1 - std::sqrt(1 - bent)) * along * along.transpose());
  by_pose = root * by_pose;
  by_place = root * by_place;
  by_lens = root * by_lens;
  error *= std::sqrt(weight / (1 - bent));
  return true;
}

}  // namespace organbake
