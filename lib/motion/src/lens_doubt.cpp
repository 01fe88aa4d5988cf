// SPDX-License-Identifier: GPL-3.0-or-later
//
// How sure the lens is that a clip told of itself. In: a scene that bundle adjustment has settled.
// What tracks have wrong hangs together: along a track, as its window slides, and among the tracks
// of one fold or gloss. So the equations' own covariance, which counts each sighting as one more
// witness, is far too sure. Left out are whole regions of the tissue, one after another, and whole
// stretches of the clip, each by one Newton step from the solution; both variances add up
// (jackknife by clusters of two kinds; Cameron, Gelbach & Miller 2011). Out: standard deviations.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "organbake/core/parallel.h"
#include "organbake/motion/scene.h"
#include "two_views.h"

namespace organbake {
namespace {

// Normal equations of poses and lens, the landmarks' places eliminated (Schur complement); of the
// matrix the lower half.
struct NormalEquations {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;

  void add(const Landmark& landmark, const FreeLens& free, const Scene& scene,
           const std::vector<bool>& counted) {
    const Eigen::Index lens_at = right.size() - kOfLens;
    Eigen::Matrix3d place = Eigen::Matrix3d::Zero();
    Eigen::Vector3d place_right = Eigen::Vector3d::Zero();
    // Where a block of unknowns begins, and how it hangs together with the place.
    std::vector<std::pair<Eigen::Index, Eigen::MatrixXd>> ties;
    Eigen::MatrixXd lens_tie = Eigen::MatrixXd::Zero(kOfLens, kOfPlace);
    WeighedSighting one;
    for (const Sighting& seen : landmark.seen) {
      if (!seen.agrees || !counted[seen.view] || !one.weigh(seen, landmark, free, scene)) continue;
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

// By view: whether it has a pose.
std::vector<bool> posed(const Scene& scene) {
  std::vector<bool> views(scene.camera_from_world.size());
  for (std::size_t v = 0; v < views.size(); ++v) views[v] = scene.camera_from_world[v].has_value();
  return views;
}

// The equations of some landmarks, by the views that are counted, each of which has a pose.
NormalEquations equations_of(const std::vector<std::size_t>& landmarks, const FreeLens& free,
                             const Scene& scene, const std::vector<bool>& counted) {
  const auto unknowns =
      static_cast<Eigen::Index>(kOfPose * scene.camera_from_world.size() + kOfLens);
  NormalEquations sums{Eigen::MatrixXd::Zero(unknowns, unknowns), Eigen::VectorXd::Zero(unknowns)};
  for (const std::size_t i : landmarks) sums.add(scene.landmarks[i], free, scene, counted);
  return sums;
}

// Lens steps without one region of the tissue after another.
std::vector<Eigen::Vector2d> steps_without_regions(const std::vector<std::size_t>& placed,
                                                   const FreeLens& free, const Scene& scene) {
  constexpr int kHalvings = 3;
  std::vector<std::vector<std::size_t>> regions;
  split(placed, kHalvings, scene, regions);
  const std::vector<bool> views = posed(scene);
  std::vector<NormalEquations> parts(regions.size());
  parallel_for(std::size_t{0}, regions.size(),
               [&](std::size_t i) { parts[i] = equations_of(regions[i], free, scene, views); });
  NormalEquations all = parts[0];
  for (std::size_t i = 1; i < parts.size(); ++i)
    all = {all.matrix + parts[i].matrix, all.right + parts[i].right};
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
  const std::vector<bool> views = posed(scene);
  const std::size_t all = scene.posed_views(), count = std::min(kStretches, all);
  std::vector<Eigen::Vector2d> steps(count);
  parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    std::vector<bool> rest = views;
    std::size_t at = 0;
    for (std::size_t v = 0; v < views.size(); ++v)
      if (views[v] && at++ * count / all == i) rest[v] = false;
    steps[i] = equations_of(placed, free, scene, rest).lens_step();
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
