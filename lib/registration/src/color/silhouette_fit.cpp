// SPDX-License-Identifier: GPL-3.0-or-later
#include "color/color_silhouette.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <map>

namespace organbake {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

// How far a start is off along and about each axis, so that all three together are 20 mm and 15°.
constexpr double kShift_mm = 20 / 1.7320508, kTurn_rad = 0.2618 / 1.7320508;
constexpr double kMostShift_mm = 50, kMostTurn_rad = 0.7;

Motion expected() {
  Motion sd;
  sd << Eigen::Vector3d::Constant(kTurn_rad), Eigen::Vector3d::Constant(kShift_mm);
  return sd;
}

// The organ's cover against what its colours say, a residual for each pixel by how much it tells.
class Residuals {
 public:
  Residuals(const RegisteredSurface& surface, const ColorScene& scene, const ObjectPose& start,
            double blur_px, const std::vector<float>& likely)
      : surface_(surface), scene_(scene), start_(start), blur_px_(blur_px), likely_(likely) {}

  std::vector<float> at(const Motion& motion) const {
    std::vector<float> r = covered(surface_, scene_.level, moved(start_, motion), blur_px_);
    for (std::size_t i = 0; i < r.size(); ++i)
      r[i] = scene_.level.valid[i] ? std::sqrt(telling(likely_[i])) * (r[i] - likely_[i]) : 0;
    return r;
  }

  // By each part of the motion, over about a pixel: outlines are steps.
  std::array<std::vector<float>, 6> slopes(const Motion& motion) const {
    constexpr double kStep = 0.05;  // of what is expected
    std::array<std::vector<float>, 6> slopes;
    tbb::parallel_for(0, 6, [&](int j) {
      const double step = kStep * expected()[j];
      slopes[j] = at(motion + step * Motion::Unit(j));
      const std::vector<float> other = at(motion - step * Motion::Unit(j));
      for (std::size_t i = 0; i < other.size(); ++i)
        slopes[j][i] = static_cast<float>((slopes[j][i] - other[i]) / (2 * step));
    });
    return slopes;
  }

 private:
  const RegisteredSurface& surface_;
  const ColorScene& scene_;
  const ObjectPose start_;
  const double blur_px_;
  const std::vector<float>& likely_;
};

double dot(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += double(a[i]) * b[i];
  return sum;
}

Matrix6 squares(const std::array<std::vector<float>, 6>& slopes) {
  Matrix6 m;
  for (int j = 0; j < 6; ++j)
    for (int k = 0; k <= j; ++k) m(j, k) = m(k, j) = dot(slopes[j], slopes[k]);
  return m;
}

// Levenberg–Marquardt steps with what is expected of a start as a prior.
Motion climb(const Residuals& residuals, double prior, Motion motion) {
  constexpr int kSteps = 3, kTries = 5;
  const Motion precision = prior * expected().cwiseAbs2().cwiseInverse();
  const auto cost = [&](const std::vector<float>& r, const Motion& m) {
    return dot(r, r) + m.cwiseAbs2().dot(precision);
  };
  std::vector<float> r = residuals.at(motion);
  double damping = 1e-3;
  for (int step = 0; step < kSteps; ++step) {
    const auto slopes = residuals.slopes(motion);
    Matrix6 a = squares(slopes);
    Motion g = precision.cwiseProduct(motion);
    for (int j = 0; j < 6; ++j) g[j] += dot(slopes[j], r);
    a.diagonal() += precision;
    bool better = false;
    for (int attempt = 0; attempt < kTries && !better; ++attempt) {
      Matrix6 damped = a;
      damped.diagonal() *= 1 + damping;
      const Motion next = motion - damped.ldlt().solve(g);
      if (!next.allFinite()) return motion;
      std::vector<float> then = residuals.at(next);
      better = cost(then, next) < cost(r, motion);
      damping *= better ? 0.3 : 5;
      if (!better) continue;
      motion = next;
      r = std::move(then);
    }
    if (!better) break;
  }
  return motion;
}

}  // namespace

SilhouetteFit fit_silhouette(const RegisteredSurface& surface, const ColorScene& scene,
                             const ObjectPose& start, const RunContext& context) {
  constexpr int kRounds = 24;
  constexpr double kFirstBlur = 0.19, kSharper = 0.75;  // of the radius
  // Weight of a start against the organ's pixels: less and less, as colours become known.
  constexpr double kPrior = 0.02, kLess = 0.8, kFewestPixels = 40;
  SilhouetteFit fit;
  fit.pose = start;
  if (scene.empty() || !in_front(surface, start)) return fit;
  Motion motion = Motion::Zero();
  for (int round = 0; round < kRounds; ++round) {
    context.throw_if_cancelled();
    const double blur_px = kFirstBlur * scene.radius_px * std::pow(kSharper, round);
    const std::vector<float> cover = covered(surface, scene.level, fit.pose, blur_px);
    double area = 0;
    for (const float share : cover) area += share;
    if (area < kFewestPixels) return fit;
    fit.likely = likely_organ(scene, cover);
    const Residuals residuals(surface, scene, start, blur_px, fit.likely);
    motion = climb(residuals, kPrior * area * std::pow(kLess, round), motion);
    fit.pose = moved(start, motion);
    if (!in_front(surface, fit.pose)) return fit;
  }
  fit.likely = likely_organ(scene, covered(surface, scene.level, fit.pose, 0));
  fit.usable = motion.head<3>().norm() < kMostTurn_rad && motion.tail<3>().norm() < kMostShift_mm;
  return fit;
}

Curvature silhouette_curvature(const RegisteredSurface& surface, const ColorScene& scene,
                               const SilhouetteFit& fit) {
  constexpr int kPatch_px = 12;
  const Residuals residuals(surface, scene, fit.pose, 0, fit.likely);
  const std::vector<float> r = residuals.at(Motion::Zero());
  const auto slopes = residuals.slopes(Motion::Zero());
  Curvature result;
  result.information = squares(slopes);
  result.pixels = r.size();
  std::map<std::pair<int, int>, Eigen::VectorXd> patches;
  const int width = scene.level.intrinsics.width;
  for (std::size_t i = 0; i < r.size(); ++i) {
    if (r[i] == 0) continue;
    const int x = static_cast<int>(i) % width, y = static_cast<int>(i) / width;
    auto& slope = patches[{y / kPatch_px, x / kPatch_px}];
    if (slope.size() == 0) slope = Eigen::VectorXd::Zero(6);
    for (int j = 0; j < 6; ++j) slope[j] += double(r[i]) * slopes[j][i];
  }
  for (const auto& [cell, slope] : patches) result.patch_slopes.push_back(slope);
  return result;
}

}  // namespace organbake
