// SPDX-License-Identifier: GPL-3.0-or-later
//
// Poses, places and lens moved together until the sightings that agree lie where the places are
// seen: bundle adjustment (Triggs et al. 2000) by Ceres' sparse Schur complement, robustly
// (Cauchy). In: a scene with sightings, and what of its lens is free. Out: the same scene, moved.
#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "organbake/core/parallel.h"
#include "organbake/motion/scene.h"
#include "two_views.h"

namespace organbake {
Eigen::Matrix<double, 2, 3> pixel_slopes(const Intrinsics& lens, const Eigen::Vector3d& point) {
  constexpr double kStep = 1e-6;
  const double x = point.x() / point.z(), y = point.y() / point.z();
  const Eigen::Vector2d along_x = (project(lens, Eigen::Vector3d(x + kStep, y, 1)) -
                                   project(lens, Eigen::Vector3d(x - kStep, y, 1))) /
                                  (2 * kStep);
  const Eigen::Vector2d along_y = (project(lens, Eigen::Vector3d(x, y + kStep, 1)) -
                                   project(lens, Eigen::Vector3d(x, y - kStep, 1))) /
                                  (2 * kStep);
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
  SightingCost(const Eigen::Vector2d& pixel, const Intrinsics& lens) : pixel_(pixel), lens_(lens) {}

  bool Evaluate(const double* const* blocks, double* error, double** slopes) const override {
    const Eigen::Map<const Eigen::Vector3d> w(blocks[0]), translation(blocks[0] + 3),
        place(blocks[1]);
    const Turned turned(w);
    const Eigen::Vector3d arm = turned.rotation * place, point = arm + translation;
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
        problem_(caller_owns_loss()),
        lens_{scene.lens.fx, scene.lens.k1},
        poses_(scene.camera_from_world.size()),
        taken_(poses_.size(), 0) {
    for (std::size_t view = 0; view < poses_.size(); ++view)
      if (scene.is_posed(view)) poses_[view] = block_of(*scene.camera_from_world[view]);
  }

  void run() {
    add_sightings();
    if (problem_.NumResidualBlocks() == 0) return;
    hold_lens();
    hold_poses();
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
      if (!is_before(*scene_.camera_from_world[sighting.view], *landmark.place)) continue;
      ++taken_[sighting.view];
      problem_.AddResidualBlock(new SightingCost(sighting.pixel, scene_.lens), &robust_,
                                poses_[sighting.view].data(), landmark.place->data(), lens_.data());
    }
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
  }

  const AdjustmentOptions& options_;
  Scene& scene_;
  ceres::CauchyLoss robust_{kRobust_px};
  ceres::Problem problem_;
  LensBlock lens_;
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

// How sure the lens is. What tracks have wrong hangs together: along a track, as its window slides,
// and among the tracks of one fold or gloss. So the equations' own covariance, which counts each
// sighting as one more witness, is far too sure. Left out are whole regions of the tissue, one
// after another, and whole stretches of the clip, each by one Newton step from the solution; both
// variances add up (jackknife by clusters of two kinds; Cameron, Gelbach & Miller 2011).
namespace {

constexpr int kOfPose = 6, kOfLens = 2, kOfPlace = 3;

// A sighting's error and how it changes, weighed as the robust cost bends there (Triggs et al.
// 2000, 4.3): across the error by the weight alone, along it by less.
struct WeighedSighting {
  Eigen::Vector2d error;
  Eigen::Matrix<double, 2, kOfPose, Eigen::RowMajor> by_pose;
  Eigen::Matrix<double, 2, kOfPlace, Eigen::RowMajor> by_place;
  Eigen::Matrix<double, 2, kOfLens, Eigen::RowMajor> by_lens;

  bool weigh(const Sighting& seen, const Landmark& landmark, const FreeLens& free,
             const Scene& scene) {
    const PoseBlock pose = block_of(*scene.camera_from_world[seen.view]);
    const LensBlock lens{scene.lens.fx, scene.lens.k1};
    const double* blocks[] = {pose.data(), landmark.place->data(), lens.data()};
    double* slopes[] = {by_pose.data(), by_place.data(), by_lens.data()};
    if (!SightingCost(seen.pixel, scene.lens).Evaluate(blocks, error.data(), slopes)) return false;
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
};

// Normal equations of poses and lens, the landmarks' places eliminated (Schur complement); of the
// matrix the lower half.
struct NormalEquations {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;

  void add(const Landmark& landmark, const FreeLens& free, const Scene& scene) {
    const Eigen::Index lens_at = right.size() - kOfLens;
    Eigen::Matrix3d place = Eigen::Matrix3d::Zero();
    Eigen::Vector3d place_right = Eigen::Vector3d::Zero();
    // Where a block of unknowns begins, and how it hangs together with the place.
    std::vector<std::pair<Eigen::Index, Eigen::MatrixXd>> ties;
    Eigen::MatrixXd lens_tie = Eigen::MatrixXd::Zero(kOfLens, kOfPlace);
    WeighedSighting one;
    for (const Sighting& seen : landmark.seen) {
      if (!seen.agrees || !scene.is_posed(seen.view) || !one.weigh(seen, landmark, free, scene))
        continue;
      const auto at = static_cast<Eigen::Index>(kOfPose * seen.view);
      matrix.block<kOfPose, kOfPose>(at, at) += one.by_pose.transpose() * one.by_pose;
      matrix.block<kOfLens, kOfPose>(lens_at, at) += one.by_lens.transpose() * one.by_pose;
      matrix.bottomRightCorner<kOfLens, kOfLens>() += one.by_lens.transpose() * one.by_lens;
      right.segment<kOfPose>(at) += one.by_pose.transpose() * one.error;
      right.tail<kOfLens>() += one.by_lens.transpose() * one.error;
      place += one.by_place.transpose() * one.by_place;
      place_right += one.by_place.transpose() * one.error;
      ties.emplace_back(at, one.by_pose.transpose() * one.by_place);
      lens_tie += one.by_lens.transpose() * one.by_place;
    }
    if (ties.size() < 2) return;
    ties.emplace_back(lens_at, lens_tie);
    const Eigen::LDLT<Eigen::Matrix3d> of_place(place);
    for (std::size_t i = 0; i < ties.size(); ++i) {
      const auto& [row, tie] = ties[i];
      const Eigen::MatrixXd solved = of_place.solve(tie.transpose()).transpose();
      right.segment(row, tie.rows()) -= solved * place_right;
      for (std::size_t j = 0; j <= i; ++j)
        matrix.block(row, ties[j].first, tie.rows(), ties[j].second.rows()) -=
            solved * ties[j].second.transpose();
    }
  }

  // The Newton step of the lens. What the scene's own freedom (its place, turn and size) leaves
  // open stays as it is.
  Eigen::Vector2d lens_step() const {
    constexpr double kOpen = 1e-10;
    const Eigen::VectorXd scale =
        matrix.diagonal().unaryExpr([](double d) { return d > 0 ? 1 / std::sqrt(d) : 1; });
    Eigen::MatrixXd scaled = scale.asDiagonal() * matrix * scale.asDiagonal();
    scaled.diagonal().array() += kOpen;
    const Eigen::VectorXd step = -scaled.ldlt().solve(Eigen::VectorXd(scale.asDiagonal() * right));
    return (scale.asDiagonal() * step).tail<kOfLens>();
  }
};

// Halves landmarks again and again, across where their places lie widest apart.
void split(std::vector<std::size_t> landmarks, int times, const Scene& scene,
           std::vector<std::vector<std::size_t>>& regions) {
  if (times == 0) return regions.push_back(std::move(landmarks));
  Eigen::AlignedBox3d box;
  for (const std::size_t i : landmarks) box.extend(*scene.landmarks[i].place);
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  const auto middle = landmarks.begin() + static_cast<std::ptrdiff_t>(landmarks.size() / 2);
  std::nth_element(landmarks.begin(), middle, landmarks.end(), [&](std::size_t a, std::size_t b) {
    return (*scene.landmarks[a].place)[axis] < (*scene.landmarks[b].place)[axis];
  });
  split({landmarks.begin(), middle}, times - 1, scene, regions);
  split({middle, landmarks.end()}, times - 1, scene, regions);
}

// The equations of some landmarks, by the views that have a pose.
NormalEquations equations_of(const std::vector<std::size_t>& landmarks, const FreeLens& free,
                             const Scene& scene) {
  const auto unknowns =
      static_cast<Eigen::Index>(kOfPose * scene.camera_from_world.size() + kOfLens);
  NormalEquations sums{Eigen::MatrixXd::Zero(unknowns, unknowns), Eigen::VectorXd::Zero(unknowns)};
  for (const std::size_t i : landmarks) sums.add(scene.landmarks[i], free, scene);
  return sums;
}

// Lens steps without one region of the tissue after another.
std::vector<Eigen::Vector2d> steps_without_regions(const std::vector<std::size_t>& placed,
                                                   const FreeLens& free, const Scene& scene) {
  constexpr int kHalvings = 3;
  std::vector<std::vector<std::size_t>> regions;
  split(placed, kHalvings, scene, regions);
  std::vector<NormalEquations> parts(regions.size());
  parallel_for(std::size_t{0}, regions.size(),
               [&](std::size_t i) { parts[i] = equations_of(regions[i], free, scene); });
  NormalEquations all = parts[0];
  for (std::size_t i = 1; i < parts.size(); ++i) {
    all.matrix += parts[i].matrix;
    all.right += parts[i].right;
  }
  std::vector<Eigen::Vector2d> steps(parts.size());
  parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) {
    steps[i] =
        NormalEquations{all.matrix - parts[i].matrix, all.right - parts[i].right}.lens_step();
  });
  return steps;
}

// Likewise without one stretch of the clip after another.
std::vector<Eigen::Vector2d> steps_without_stretches(const std::vector<std::size_t>& placed,
                                                     const FreeLens& free, const Scene& scene) {
  constexpr std::size_t kStretches = 8;
  const std::size_t posed = scene.posed_views(), count = std::min(kStretches, posed);
  std::vector<Eigen::Vector2d> steps(count);
  parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    Scene rest = scene;
    std::size_t at = 0;
    for (auto& pose : rest.camera_from_world)
      if (pose && at++ * count / posed == i) pose.reset();
    steps[i] = equations_of(placed, free, rest).lens_step();
  });
  return steps;
}

Eigen::Vector2d jackknife_variance(const std::vector<Eigen::Vector2d>& steps) {
  const auto count = static_cast<double>(steps.size());
  Eigen::Vector2d mean = Eigen::Vector2d::Zero(), squares = mean;
  for (const Eigen::Vector2d& step : steps) mean += step / count;
  for (const Eigen::Vector2d& step : steps) squares += (step - mean).cwiseAbs2();
  return squares * (count - 1) / count;
}

}  // namespace

LensSpread lens_spread(const FreeLens& free, const Scene& scene, double focal_variance_px2) {
  if (!free.focal && !free.distortion) return {};
  std::vector<std::size_t> placed;
  for (std::size_t i = 0; i < scene.landmarks.size(); ++i)
    if (scene.landmarks[i].place) placed.push_back(i);
  const Eigen::Vector2d variance = jackknife_variance(steps_without_regions(placed, free, scene)) +
                                   jackknife_variance(steps_without_stretches(placed, free, scene));
  // Whatever is left out, windows slide along edges a little in the same way.
  constexpr double kNeverTold = 0.005;
  const double never_told = kNeverTold * scene.lens.fx;
  return {free.focal ? std::sqrt(variance[0] + focal_variance_px2 + never_told * never_told) : 0,
          std::sqrt(variance[1])};
}

}  // namespace organbake
