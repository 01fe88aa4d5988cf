// SPDX-License-Identifier: GPL-3.0-or-later
//
// Poses, places and lens moved together until the sightings that agree lie where the places are
// seen: bundle adjustment (Triggs et al. 2000) by Ceres' sparse Schur complement, robustly
// (Cauchy). In: a scene with sightings, and what of its lens is free. Out: the same scene, moved;
// and how a sighting's error bends there, by which a lens is doubted (lens_doubt.cpp).
#include <ceres/rotation.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "adjustment_costs.h"
#include "organbake/motion/scene.h"

namespace organbake {
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

// A sighting from behind is no sighting: no step leads from there, and one such would end all.
bool is_before(const RigidTransform& camera_from_world, const Eigen::Vector3d& place) {
  return (camera_from_world * place).z() > kNearest;
}

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
    for (const std::size_t view : scene.posed())
      poses_[view] = block_of(*scene.camera_from_world[view]);
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
      if (SolvedBreath* breath = options_.breath)
        problem_.AddResidualBlock(
            breathing_cost(sighting.pixel, scene_.lens, breath->time_of(sighting.view),
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
    const SolvedBreath& breath = *options_.breath;
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
      problem_.AddResidualBlock(even_way_cost((now - start) / (breath.time_of(*after) - start),
                                              breath.depth, kWeight_px * scene_.lens.fx),
                                nullptr, poses_[*before].data(), poses_[view].data(),
                                poses_[*after].data());
    }
  }

  std::vector<std::size_t> moved_views() const {
    std::vector<std::size_t> views = scene_.posed();
    std::erase_if(views,
                  [&](auto view) { return !problem_.HasParameterBlock(poses_[view].data()); });
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
    for (const std::size_t view : moved_views()) {
      if (moves(view) && held) continue;
      if (moves(view)) held = true;
      problem_.SetParameterBlockConstant(poses_[view].data());
    }
  }

  void keep_result() {
    for (const std::size_t view : moved_views())
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
  std::array<double, kOfCourse> course_ = {};  // waves, then radians per frame
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
