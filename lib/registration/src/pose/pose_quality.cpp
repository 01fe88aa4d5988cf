// SPDX-License-Identifier: GPL-3.0-or-later
// What a finished pose is worth: standard deviations by the sandwich estimator over patches (White
// 1980; Liang & Zeger 1986), since what a model leaves of a photograph is correlated; and checks of
// outline, visibility, focal length and rivals, whose bounds no wrong pose of the measured ones
// passes.
#include "pose/poses.h"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "organbake/core/text.h"
#include "organbake/geometry/dense_solve.h"

namespace organbake {
namespace {

// Whether a photograph confirms the outline: profiles across it, predicted and seen, are correlated
// at shifts either way. A wrong organ of about the right shape correlates well as a whole, but its
// outline lies off in places.

struct OutlineCheck {
  int places = 0;    // pixels of the outline
  int asked = 0;     // places along the outline where photograph and prediction vary at all
  double share = 0;  // of those, the prediction fits best within a pixel of where it is
};

using Eigen::Vector2d;
constexpr int kReach = 10;                // pixels across the outline, either way
constexpr int kHalf = 6;                  // pixels: half the length of what is compared
constexpr int kAlong = 2;                 // pixels averaged along the outline, either way
constexpr int kConfirmed = 1;             // pixels
constexpr double kLeastContrast = 0.004;  // of the luminance range, RMS: below, nothing is there

// Whether an open surface ends there because it was cut.
bool is_cut_near(const Prediction& p, int x, int y) {
  constexpr int kNear = 2;  // pixels
  if (p.border_px.empty()) return false;
  for (int v = y - kNear; v <= y + kNear; ++v)
    for (int u = x - kNear; u <= x + kNear; ++u)
      if (p.contains(u, v) && p.coverage[p.index(u, v)] > 0 &&
          p.border_px[p.index(u, v)] < 2 * kNear)
        return true;
  return false;
}

// Outwards across the outline; zero where the pixel is not on it.
Vector2d outward(const Prediction& p, int x, int y) {
  const auto coverage = [&p](int u, int v) {
    return p.contains(u, v) ? p.coverage[p.index(u, v)] : 0.0f;
  };
  const float here = coverage(x, y);
  if (!(here > 0) || (here == 1 && coverage(x - 1, y) > 0 && coverage(x + 1, y) > 0 &&
                      coverage(x, y - 1) > 0 && coverage(x, y + 1) > 0)) {
    return Vector2d::Zero();
  }
  if (is_cut_near(p, x, y)) return Vector2d::Zero();
  Vector2d slope = Vector2d::Zero();
  for (int v = -2; v <= 2; ++v)
    for (int u = -2; u <= 2; ++u) slope -= coverage(x + u, y + v) * Vector2d(u, v);
  return slope.norm() > 0 ? Vector2d(slope.normalized()) : slope;
}

template <int HalfLength>
using Profile = std::array<double, 2 * HalfLength + 1>;

// Values along the normal, inside first, averaged along the outline. Nothing when any of them is.
template <int HalfLength, class Value>
std::optional<Profile<HalfLength>> profile(const Vector2d& at, const Vector2d& normal,
                                           const Value& value) {
  Profile<HalfLength> values{};
  const Vector2d along(-normal.y(), normal.x());
  for (int i = -HalfLength; i <= HalfLength; ++i)
    for (int s = -kAlong; s <= kAlong; ++s) {
      const Vector2d q = at + i * normal + s * along;
      const std::optional<double> here =
          value(static_cast<int>(std::floor(q.x())), static_cast<int>(std::floor(q.y())));
      if (!here) return std::nullopt;
      values[i + HalfLength] += *here / (2 * kAlong + 1);
    }
  return values;
}

// Correlation of the predicted profile with the photograph's, `shift` pixels farther out.
double correlation(const Profile<kHalf>& predicted, const Profile<kHalf + kReach>& seen,
                   int shift) {
  constexpr int kCount = 2 * kHalf + 1;
  double mp = 0, ms = 0, ps = 0, pp = 0, ss = 0;
  for (int i = 0; i < kCount; ++i) {
    mp += predicted[i] / kCount;
    ms += seen[i + kReach + shift] / kCount;
  }
  for (int i = 0; i < kCount; ++i) {
    const double p = predicted[i] - mp, s = seen[i + kReach + shift] - ms;
    ps += p * s;
    pp += p * p;
    ss += s * s;
  }
  const double least = kCount * kLeastContrast * kLeastContrast;
  return pp > least && ss > least ? ps / std::sqrt(pp * ss) : -2;
}

struct Match {
  int shift = 0;
  double correlation = -2;
};

Match best_match(const Profile<kHalf>& predicted, const Profile<kHalf + kReach>& seen) {
  Match best;
  for (int distance = 0; distance <= kReach; ++distance)
    for (const int shift : {-distance, distance}) {
      const double value = correlation(predicted, seen, shift);
      if (value > best.correlation) best = {shift, value};
    }
  return best;
}

// Shifts the predicted picture across its outline, place by place, up to 10 pixels either way, and
// looks where the photograph agrees best. R can be high for a wrong organ of about the right shape;
// that its outline lies right all round is another matter. `background` is the radiance beyond the
// prediction's window.
OutlineCheck check_outline(const PhotoLevel& level, const Prediction& p, double background) {
  const auto predicted = [&](int x, int y) -> std::optional<double> {
    return p.contains(x, y) ? p.radiance[p.index(x, y)] : background;
  };
  const auto seen = [&](int x, int y) -> std::optional<double> {
    const bool inside =
        x >= 0 && y >= 0 && x < level.intrinsics.width && y < level.intrinsics.height;
    if (!inside || !level.valid[level.index(x, y)]) return std::nullopt;
    return level.luminance[level.index(x, y)];
  };
  OutlineCheck check;
  int confirmed = 0;
  for (int y = p.top; y < p.top + p.height; ++y)
    for (int x = p.left; x < p.left + p.width; ++x) {
      const Vector2d normal = outward(p, x, y);
      if (normal.isZero()) continue;
      ++check.places;
      const Vector2d at(x + 0.5, y + 0.5);
      const auto ours = profile<kHalf>(at, normal, predicted);
      const auto theirs = profile<kHalf + kReach>(at, normal, seen);
      if (!ours || !theirs) continue;
      const Match match = best_match(*ours, *theirs);
      if (match.correlation < -1) continue;
      ++check.asked;
      confirmed += std::abs(match.shift) <= kConfirmed;
    }
  if (check.asked > 0) check.share = static_cast<double>(confirmed) / check.asked;
  return check;
}

using Eigen::Vector3d;

// Covariance of what the solver moved, over patches: H⁻¹ (Σ g gᵀ) H⁻¹ (White 1980; clustered,
// Liang & Zeger 1986). Not finite where nothing holds it.
Eigen::MatrixXd sandwich_covariance(const Curvature& curvature) {
  const Eigen::Index n = curvature.information.rows();
  Eigen::MatrixXd information = curvature.information;
  information.diagonal() *= 1 + 1e-12;
  const Eigen::MatrixXd inverse = solve_symmetric(information, Eigen::MatrixXd::Identity(n, n));
  Eigen::MatrixXd meat = Eigen::MatrixXd::Zero(n, n);
  for (const Eigen::VectorXd& slope : curvature.patch_slopes) meat += slope * slope.transpose();
  return inverse * meat * inverse;
}

// Bounds of the verdict. They were set on photographs of the phantom with known poses, right and
// wrong ones, so that no wrong one passes (tests/acceptance, RegistrationLights).
constexpr double kLeastVisible = 0.6;
constexpr double kLeastVisibleOpen = 0.25;  // of a piece: it was cut anyway
constexpr double kLeastCorrelation = 0.55, kSureCorrelation = 0.7;
constexpr double kLeastOutline = 0.25, kSureOutline = 0.6;
constexpr double kLeastAsked = 0.2;  // right poses: 0.43 and more
constexpr double kLeastInliers = 0.6;
constexpr double kLargestSurfaceSdMm = 1.0;
constexpr double kLeastMargin = 0.1;
constexpr double kLargestFocalError = 0.07;  // exact lenses: 0.02 at most, 10 % off: 0.09

// Motion of a surface point by the pose: (ω, τ) ↦ ω × (x − c) + τ.
Eigen::Matrix<double, 3, 6> point_motion(const Vector3d& d) {
  Eigen::Matrix<double, 3, 6> j;
  j << 0, d.z(), -d.y(), 1, 0, 0, -d.z(), 0, d.x(), 0, 1, 0, d.y(), -d.x(), 0, 0, 0, 1;
  return j;
}

// What a free focal length would want; 1 unless that is well outside what texture and noise do to
// it.
double wanted_focal_scale(const FocalCheck& check) {
  constexpr double kSignificant = 4;  // standard deviations
  return std::abs(check.log_scale) > kSignificant * check.log_sd ? std::exp(check.log_scale) : 1;
}

// Of a smaller picture a pixel is a larger part of the organ, so that more of another organ's
// outline lies within one: up to 0.54 of it at a diameter of about 370 pixels, 0.73 at 250.
double sure_outline(double organ_px) {
  constexpr double kLargeEnough = 310, kPerPixel = 0.0022, kMost = 0.95;
  return std::min(kMost, kSureOutline + kPerPixel * std::max(0.0, kLargeEnough - organ_px));
}

void judge(PoseQuality& q, double organ_px, bool open) {
  const double least_visible = open ? kLeastVisibleOpen : kLeastVisible;
  // A piece without outlines in the picture has none elsewhere; that nothing then confirms its pose
  // is another matter.
  const bool has_outline = !open || q.outline_asked_share >= kLeastAsked;
  const VerdictRule rules[] = {
      {!(q.visible_share >= least_visible), Verdict::failed,
       "only " + percent(q.visible_share) + " of the facing surface is in the picture, " +
           percent(least_visible) + " are needed"},
      {!(q.correlation >= kLeastCorrelation), Verdict::failed,
       "the photograph does not look like the surface: R = " + to_text(q.correlation, 3)},
      {!has_outline, Verdict::doubtful,
       "the surface is open and hardly any of the organ's outline is in the picture: nothing "
       "confirms the pose"},
      {!(q.outline_share >= kLeastOutline), Verdict::failed,
       "the photograph has the outline elsewhere: " + percent(q.outline_share) + " of it fits"},
      {!(q.outline_share >= sure_outline(organ_px)), Verdict::doubtful,
       "only " + percent(q.outline_share) + " of the outline fits; " +
           percent(sure_outline(organ_px)) + " should, of an organ as large in its picture"},
      {!(q.outline_asked_share >= kLeastAsked), Verdict::doubtful,
       "only " + percent(q.outline_asked_share) + " of the outline could be looked at, " +
           percent(kLeastAsked) + " are needed: it must lie well inside the picture, unmasked"},
      {!(q.correlation >= kSureCorrelation), Verdict::doubtful,
       "the photograph looks little like the surface: R = " + to_text(q.correlation, 3)},
      {!(q.inlier_share >= kLeastInliers), Verdict::doubtful,
       "only " + percent(q.inlier_share) + " of the organ's pixels fit"},
      {!(q.surface_sd_mm <= kLargestSurfaceSdMm), Verdict::doubtful,
       "the pose is uncertain by " + to_text(q.surface_sd_mm, 2) + " mm on the surface"},
      {!(q.runner_up_margin >= kLeastMargin), Verdict::doubtful,
       "another pose fits almost as well: it leaves only " + percent(q.runner_up_margin) +
           " more unexplained"},
      {std::abs(std::log(q.focal_scale)) > kLargestFocalError, Verdict::doubtful,
       "the focal length seems wrong: " + to_text(q.focal_scale, 2) + " times the given one fits"},
  };
  judge_by(rules, q);
}

// The share of the surface that faces the camera, and nothing of it hides, which lies inside the
// picture on pixels that count; `lens` is the level's, with the focal length that was found.
double visible_share(const RegisteredSurface& surface, const PhotoLevel& level,
                     const Intrinsics& lens, const ObjectPose& pose) {
  const RigidTransform camera_from_world = rigid_transform(pose, surface.center());
  const Vector3d eye = camera_from_world.inverse().translation;
  std::vector<const SurfaceSample*> facing;
  std::vector<Ray> rays;
  for (const SurfaceSample& sample : surface.samples()) {
    const Vector3d way = eye - sample.point;
    if (!(sample.normal.dot(way) > 0)) continue;
    facing.push_back(&sample);
    Ray ray;
    ray.origin = sample.point;
    ray.direction = way;
    ray.t_min = 1e-3 * surface.radius_mm() / way.norm();
    ray.t_max = 1;
    rays.push_back(ray);
  }
  std::vector<std::uint8_t> hidden(rays.size());
  surface.scene().occluded(rays, hidden);
  int open = 0, seen = 0;
  for (std::size_t i = 0; i < facing.size(); ++i) {
    if (hidden[i]) continue;
    ++open;
    const Vector3d x = camera_from_world * facing[i]->point;
    if (!(x.z() > 0)) continue;
    const Eigen::Vector2d pixel = project(lens, x);
    if (!(pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() < lens.width && pixel.y() < lens.height))
      continue;
    seen += level.valid[level.index(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()))];
  }
  return open > 0 ? static_cast<double>(seen) / open : 0;
}

}  // namespace

void measure_spread(const RegisteredSurface& surface, const Curvature& curvature,
                    const ObjectPose& pose, PoseQuality& quality) {
  quality.surface_sd_mm = quality.position_sd_mm = quality.rotation_sd_deg = 1e9;
  if (curvature.pixels == 0) return;
  const Eigen::MatrixXd all = sandwich_covariance(curvature);
  if (!all.allFinite()) return;
  measure_spread(surface, Eigen::Matrix<double, 6, 6>(all.topLeftCorner<6, 6>()), pose, quality);
}

void measure_spread(const RegisteredSurface& surface, const Eigen::Matrix<double, 6, 6>& cov,
                    const ObjectPose& pose, PoseQuality& quality) {
  quality.rotation_sd_deg =
      std::sqrt(std::max(0.0, cov.topLeftCorner<3, 3>().trace())) * 180 / std::numbers::pi;
  quality.position_sd_mm = std::sqrt(std::max(0.0, cov.bottomRightCorner<3, 3>().trace()));
  const Eigen::Matrix3d turn = pose.camera_from_world.toRotationMatrix();
  double sum = 0;
  for (const SurfaceSample& sample : surface.samples()) {
    const auto j = point_motion(turn * (sample.point - surface.center()));
    sum += (j * cov * j.transpose()).trace();
  }
  quality.surface_sd_mm = std::sqrt(std::max(0.0, sum / surface.samples().size()));
}

PoseQuality assess(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                   const RefineOptions& options, const RefineState& state, double runner_up_margin,
                   const RunContext& context) {
  PoseQuality quality;
  if (!state.usable || !std::isfinite(state.correlation)) {
    quality.reason = "the organ is out of the picture, or the photograph is constant there";
    return quality;
  }
  // Where an outline that is wrong by a hundredth of the organ shows, and noise is averaged.
  constexpr int kEnough = 640;
  int level = 0;
  while (level + 1 < static_cast<int>(pyramid.size()) && pyramid[level].intrinsics.width > kEnough)
    ++level;
  quality.correlation = state.correlation;
  quality.inlier_share = state.appearance.inlier_share;
  quality.runner_up_margin = runner_up_margin;
  const double found = std::exp(state.solver.log_focal);
  Intrinsics lens = pyramid[level].intrinsics;
  lens.fx *= found;
  lens.fy *= found;
  quality.visible_share = visible_share(surface, pyramid[level], lens, state.solver.object_pose());
  const ShadingBasis basis = basis_for(options, state.solver.object_pose());
  Prediction prediction;
  predict(surface, pyramid[level], state.solver.object_pose(), found, basis, state.solver.light, {},
          prediction);
  const OutlineCheck outline =
      check_outline(pyramid[level], prediction, state.solver.light[basis.size() - 1]);
  quality.outline_share = outline.share;
  if (outline.places > 0)
    quality.outline_asked_share = static_cast<double>(outline.asked) / outline.places;
  measure_spread(surface, curvature(surface, pyramid[level], options, state),
                 state.solver.object_pose(), quality);
  quality.focal_scale =
      options.free_focal || !options.check_focal
          ? 1
          : wanted_focal_scale(check_focal(surface, pyramid, options, state, context));
  judge(quality,
        2 * surface.radius_mm() * lens.fx / state.solver.object_pose().center_camera_mm.z(),
        surface.open());
  if (options.free_focal) quality.focal_scale = found;
  return quality;
}

FocalCheck check_focal(const RegisteredSurface& surface, const std::vector<PhotoLevel>& pyramid,
                       RefineOptions options, const RefineState& state, const RunContext& context) {
  constexpr int kEnough = 160;  // pixels: a wrong lens shows here, too
  // Under a light from aside the way from a wrong lens to the right one may lead uphill.
  constexpr double kStarts[] = {0, 0.15, -0.15};
  options.free_focal = true;
  options.whole_picture = true;
  options.patch_px = 8;
  // A light with freedom enough that what the lamp really does is not laid to the lens.
  if (options.light == LightModel::camera) options.light = LightModel::beam;
  int level = static_cast<int>(pyramid.size()) - 1;
  while (level > 0 && pyramid[level].intrinsics.width < kEnough) --level;
  RefineState best;
  for (const double start : kStarts) {
    RefineState tried;
    tried.solver.pose = state.solver.pose;
    tried.solver.log_focal = start;
    refine(surface, pyramid, level, level, options, tried, context);
    if (tried.usable && (!best.usable || tried.correlation > best.correlation)) best = tried;
  }
  FocalCheck check{0, std::numeric_limits<double>::infinity()};
  if (!best.usable) return check;
  const Eigen::MatrixXd spread =
      sandwich_covariance(curvature(surface, pyramid[level], options, best));
  if (spread.rows() != 7 || !spread.allFinite()) return check;
  return {best.solver.log_focal, std::sqrt(std::max(0.0, spread(6, 6)))};
}

}  // namespace organbake
