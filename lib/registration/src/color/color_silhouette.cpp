// SPDX-License-Identifier: GPL-3.0-or-later
// Registration by silhouette: Levenberg–Marquardt of the organ's cover against what colours say,
// from blurred to sharp, the colours learnt anew at each blur. The start is a prior whose weight
// falls as colours become known.
#include "color/tissue.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "organbake/core/parallel.h"
#include "organbake/core/text.h"
#include "organbake/geometry/dense_solve.h"

namespace organbake {
namespace {

struct SilhouetteFit {
  ObjectPose pose;
  std::vector<float> likely;  // likely_organ at the pose
  bool usable = false;        // the organ is in the picture and not far from its start
};

// How much a pixel's colour tells: 0 for a likelihood of 0.5, 1 where it is certain.
inline float telling(float likely) { return (2 * likely - 1) * (2 * likely - 1); }

// Of cover and likelihood, each pixel by how much it tells.
double correlation(const ColorScene& scene, const std::vector<float>& cover,
                   const std::vector<float>& likely) {
  double n = 0, c = 0, l = 0, cc = 0, ll = 0, cl = 0;
  for (std::size_t i = 0; i < cover.size(); ++i) {
    const double w = scene.level.valid[i] ? telling(likely[i]) : 0;
    n += w;
    c += w * cover[i];
    l += w * likely[i];
    cc += w * cover[i] * cover[i];
    ll += w * likely[i] * likely[i];
    cl += w * cover[i] * likely[i];
  }
  n = std::max(n, 1e-9);
  const double spread = (cc - c * c / n) * (ll - l * l / n);
  return spread > 0 ? (cl - c * l / n) / std::sqrt(spread) : 0;
}

// Of the pixels that the organ covers, the share whose colour is likely its own, of those that
// tell.
double share_of_own(const ColorScene& scene, const std::vector<float>& cover,
                    const std::vector<float>& likely) {
  double own = 0, all = 0;
  for (std::size_t i = 0; i < cover.size(); ++i) {
    if (!scene.level.valid[i]) continue;
    const double w = double(telling(likely[i])) * cover[i];
    all += w;
    own += likely[i] > 0.5f ? w : 0;
  }
  return all > 0 ? own / all : 0;
}

double share_telling(const ColorScene& scene, const std::vector<float>& cover,
                     const std::vector<float>& likely) {
  double tells = 0, all = 0;
  for (std::size_t i = 0; i < cover.size(); ++i) {
    all += cover[i];
    if (scene.level.valid[i]) tells += double(telling(likely[i])) * cover[i];
  }
  return all > 0 ? tells / all : 0;
}

// Pixels on either side of the outline and near it: how many tell, and how many of these have the
// colours of their side.
void check_sides(const RegisteredSurface& surface, const ColorScene& scene,
                 const SilhouetteFit& fit, const std::vector<float>& cover, PoseQuality& quality) {
  constexpr double kNear_px = 2;
  constexpr float kBeside = 0.02f;  // of the cover, blurred by so many pixels: within four of them
  constexpr float kTells = 0.25f, kSide = 0.25f;
  const std::vector<float> soft = covered(surface, scene.level, fit.pose, kNear_px);
  double places = 0, asked = 0, confirmed = 0;
  for (std::size_t i = 0; i < cover.size(); ++i) {
    const bool on_it = std::abs(cover[i] - 0.5f) < kSide;  // of two colours
    if (soft[i] < kBeside || soft[i] > 1 - kBeside || on_it) continue;
    ++places;
    if (!scene.level.valid[i] || telling(fit.likely[i]) < kTells) continue;
    ++asked;
    confirmed += (fit.likely[i] > 0.5f) == (cover[i] > 0.5f);
  }
  quality.outline_asked_share = places > 0 ? asked / places : 0;
  quality.outline_share = asked > 0 ? confirmed / asked : 0;
}

void judge(PoseQuality& q) {
  constexpr double kLeastCorrelation = 0.8, kLeastVisible = 0.4, kLeastOutline = 0.75;
  const VerdictRule rules[] = {
      {!(q.correlation >= kLeastCorrelation), Verdict::failed,
       "no colours of the photograph draw the surface's silhouette: R = " +
           to_text(q.correlation, 3)},
      {!(q.visible_share >= kLeastVisible), Verdict::failed,
       "only " + percent(q.visible_share) + " of the silhouette has colours of its own, " +
           percent(kLeastVisible) + " are needed"},
      {!(q.outline_share >= kLeastOutline), Verdict::failed,
       "the colours have the outline elsewhere: " + percent(q.outline_share) + " of it fits"},
      {true, Verdict::doubtful,
       "only the silhouette was compared, by its colours, and other poses may share it"}};
  judge_by(rules, q);
}

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
    parallel_for(0, 6, [&](int j) {
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
      const Motion next = motion - solve_symmetric(damped, g);
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

// Of the fit's residuals, for its covariance.
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

}  // namespace

RegisteredPhoto register_by_color(const RegisteredSurface& surface, const PhotoToRegister& photo,
                                  const RigidTransform& start, const RunContext& context) {
  RegisteredPhoto result;
  result.light = LightModel::automatic;  // none is needed
  result.camera.intrinsics = photo.intrinsics;
  result.camera.camera_from_world = start;
  const ObjectPose first = object_pose(start, surface.center());
  result.quality.reason = "the start has the organ out of the picture";
  if (!in_front(surface, first)) return result;
  const ColorScene scene = ColorScene::around(surface, photo, first);
  const SilhouetteFit fit = fit_silhouette(surface, scene, first, context);
  if (!fit.usable) {
    if (!fit.likely.empty())
      result.quality.reason =
          "no colours of the photograph draw the surface's silhouette near the start";
    return result;
  }
  const std::vector<float> cover = covered(surface, scene.level, fit.pose, 0);
  PoseQuality& quality = result.quality;
  quality.correlation = correlation(scene, cover, fit.likely);
  quality.inlier_share = share_of_own(scene, cover, fit.likely);
  quality.visible_share = share_telling(scene, cover, fit.likely);
  check_sides(surface, scene, fit, cover, quality);
  measure_spread(surface, silhouette_curvature(surface, scene, fit), fit.pose, quality);
  judge(quality);
  result.camera.camera_from_world = rigid_transform(fit.pose, surface.center());
  return result;
}

}  // namespace organbake
