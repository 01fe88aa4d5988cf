// SPDX-License-Identifier: GPL-3.0-or-later
// The pose of a piece of tissue by its colours, from many starts round the given one, fitted on a
// coarse level and thinned from level to level: such a piece has many poses that look a little
// alike.
#include "color/tissue.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/core/random.h"
#include "organbake/geometry/dense_solve.h"

namespace organbake {
namespace {

// Gauss–Newton of pose, light and hue on ln luminance of living tissue, where lamp, albedo and
// exposure add up. Neighbouring pixels share their albedo, so that they count as far fewer than
// they are; what is expected of light and motion is a Gaussian prior.

// A level of a photograph of living tissue.
struct TissueLevel {
  const PhotoLevel& photo;
  std::vector<Eigen::Vector2f> hues;  // tissue_colors.h
  double dark = 0.01;  // luminance added before the logarithm, so that black does not outweigh all
};

struct TissueFit {
  ObjectPose pose;
  TissueLight::Weights light = TissueLight::expected().mean;
  double noise = 0;  // robust standard deviation of ln luminance about the fit
  // What the fit leaves of ln luminance, far pixels capped, with the penalty for light and motion
  // that are not expected: of several fits on one level the lowest is the likeliest.
  double cost = std::numeric_limits<double>::infinity();
  double pixels = 0;   // of the level that the cost is a mean of, by their trust
  bool usable = true;  // the surface is in the picture
};

using Eigen::Vector3d;
constexpr int kMotion = 6, kAll = kMotion + TissueLight::kSize;
using Column = Eigen::Matrix<double, kAll, 1>;
using Normal = Eigen::Matrix<double, kAll, kAll>;
constexpr std::size_t kFewestPixels = 60, kEnough = 20'000;

struct Row {
  double residual = 0;
  Column slope = Column::Zero();  // of the prediction
};

// What is expected of all that is fitted, and the precision of that.
struct Prior {
  Column off, precision;

  Prior(const ObjectPose& start, const TissueFit& fit) {
    constexpr double kShift_mm = 10, kTurn_rad = 0.12;  // along and about each axis
    const TissueLight::Expected light = TissueLight::expected();
    off << motion_between(start, fit.pose), fit.light - light.mean;
    Column sd;
    sd << Vector3d::Constant(kTurn_rad), Vector3d::Constant(kShift_mm), light.sd;
    precision = sd.cwiseAbs2().cwiseInverse();
  }
  double penalty() const { return off.cwiseAbs2().dot(precision); }
};

// The surface drawn at one pose over one level: which pixels count, and what the model says there.
class View {
 public:
  View(const RegisteredSurface& surface, const TissueLevel& level, const ObjectPose& pose,
       double reference_mm)
      : level_(level.photo), pose_(pose), dark_(level.dark), reference_mm_(reference_mm) {
    const double radius_px =
        level_.intrinsics.fx * surface.radius_mm() / std::max(1e-9, pose.center_camera_mm.z());
    const int band = std::clamp(static_cast<int>(radius_px / 3), 5, 8);
    const ShadingBasis basis(LightModel::camera, reference_mm);
    predict(surface, level_, pose, 1, basis, basis.first_weights(), {.margin = band + 2}, p_);
    const std::vector<WeightedPixel> all = overlap(level_, p_, band);
    step_ = (all.size() / kEnough) | 1;  // odd: no columns of pixels
    for (std::size_t i = 0; i < all.size(); i += step_) pixels_.push_back(all[i]);
    hues_ = hue_numbers(level_, level.hues, p_, pixels_);
    shade_.resize(p_.coverage.size());
  }

  bool usable() const { return pixels_.size() >= kFewestPixels; }
  // Pixels that share their albedo: a 680th of a picture, about 4 mm of tissue.
  double pixels_a_sample() const {
    constexpr double kSamples = 680;
    return static_cast<double>(level_.luminance.size()) / kSamples / static_cast<double>(step_);
  }
  double pixels_drawn_each() const { return static_cast<double>(step_); }
  const std::vector<WeightedPixel>& pixels() const { return pixels_; }

  std::vector<Row> rows(const TissueLight::Weights& light) {
    parallel_for(std::size_t{0}, shade_.size(), [&](std::size_t i) {
      if (p_.coverage[i] > 0)
        shade_[i] = log_radiance(p_.point[i].cast<double>(), p_.normal[i].cast<double>(), light,
                                 reference_mm_) +
                    std::log(std::max(kLeastAlbedo, p_.albedo[i] / p_.coverage[i]));
    });
    std::vector<Row> rows(pixels_.size());
    parallel_for(std::size_t{0}, rows.size(), [&](std::size_t i) { rows[i] = row(i, light); });
    return rows;
  }

 private:
  static constexpr float kLeastAlbedo = 1e-3f;

  // Of the window's pixel, if the tissue there had `hue` for its colour.
  double organ(std::size_t at, double hue) const {
    constexpr double kMost = 20;
    return p_.coverage[at] > 0 ? p_.coverage[at] * std::exp(std::min(kMost, shade_[at] + hue)) : 0;
  }
  double log_luminance(int x, int y, double hue, double ground) const {
    if (!p_.contains(x, y)) return std::log(ground + dark_);
    const std::size_t at = p_.index(x, y);
    return std::log(organ(at, hue) + (1 - p_.coverage[at]) * ground + dark_);
  }
  // Not beyond a cut, where nothing is known.
  bool known(int x, int y) const {
    return p_.contains(x, y) && (p_.border_px.empty() || !(p_.coverage[p_.index(x, y)] > 0) ||
                                 p_.border_px[p_.index(x, y)] > 0);
  }
  Row row(std::size_t i, const TissueLight::Weights& light) const;
  Eigen::RowVector2d picture_slope(int x, int y, double hue, double ground) const;

  const PhotoLevel& level_;
  const ObjectPose& pose_;
  double dark_, reference_mm_;
  std::size_t step_ = 1;
  Prediction p_;
  std::vector<WeightedPixel> pixels_;
  std::vector<TissueLight::Hues> hues_;
  std::vector<double> shade_;
};

Eigen::RowVector2d View::picture_slope(int x, int y, double hue, double ground) const {
  const auto between = [&](int u0, int v0, int u1, int v1) {
    return known(u0, v0) && known(u1, v1)
               ? 0.5 * (log_luminance(u1, v1, hue, ground) - log_luminance(u0, v0, hue, ground))
               : 0.0;
  };
  return {between(x - 1, y, x + 1, y), between(x, y - 1, x, y + 1)};
}

Row View::row(std::size_t i, const TissueLight::Weights& light) const {
  const auto [x, y, weight, trust] = pixels_[i];
  const std::size_t at = p_.index(x, y);
  const double hue = light.tail<TissueLight::kHues>().dot(hues_[i]);
  const double ground = std::exp(light[TissueLight::kGround]);
  const double predicted = log_luminance(x, y, hue, ground), all = std::exp(predicted);
  Row row;
  row.residual = std::log(std::max(0.0f, level_.luminance[level_.index(x, y)]) + dark_) - predicted;
  row.slope[kMotion + TissueLight::kGround] = (1 - p_.coverage[at]) * ground / all;
  const Vector3d point = point_near(p_, x, y);
  if (p_.coverage[at] > 0) {
    const Vector3d normal = p_.normal[at].cast<double>();
    const LogRadianceSlopes s = log_radiance_slopes(point, normal, light, reference_mm_);
    const double share = organ(at, hue) / all;
    row.slope.head<3>() =
        share * ((point - pose_.center_camera_mm).cross(s.by_point) + normal.cross(s.by_normal));
    row.slope.segment<3>(3) = share * s.by_point;
    row.slope.segment<TissueLight::kShape>(kMotion) = share * s.by_weight;
    row.slope.tail<TissueLight::kHues>() = share * hues_[i];
  }
  if (point.z() > 0)
    row.slope.head<kMotion>() -= (picture_slope(x, y, hue, ground) *
                                  pixel_motion(level_.intrinsics, point, pose_.center_camera_mm))
                                     .transpose();
  return row;
}

// The normal equations at one state, and its cost.
struct TissueSystem {
  Normal normal = Normal::Zero();
  Column right = Column::Zero();

  TissueSystem(const View& view, const std::vector<Row>& rows, const Prior& prior, TissueFit& fit) {
    constexpr double kCutoff = 3, kFar = 0.6, kLeastNoise = 0.03;
    std::vector<double> sizes;
    for (const Row& row : rows) sizes.push_back(std::abs(row.residual));
    fit.noise = std::max(kLeastNoise, kSigmaOfMedianDeviation * median(std::move(sizes)));
    const double information = 1 / (fit.noise * fit.noise * view.pixels_a_sample());
    double left = 0, trusted = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double off = rows[i].residual, trust = view.pixels()[i].trust;
      const double far = off / (kCutoff * fit.noise);
      const double weight = information * trust * robust_weight(far * far);
      normal.selfadjointView<Eigen::Lower>().rankUpdate(rows[i].slope, weight);
      right += weight * off * rows[i].slope;
      left += trust * std::min(off * off, kFar * kFar);
      trusted += trust;
    }
    fit.pixels = trusted * view.pixels_drawn_each();
    fit.cost = (left + prior.penalty() / information) / std::max(1e-9, trusted);
    normal = normal.selfadjointView<Eigen::Lower>();
    normal.diagonal() += prior.precision;
    normal.diagonal() *= 1 + 1e-6;
    right -= prior.precision.cwiseProduct(prior.off);
  }
};

void settle_light(View& view, const ObjectPose& start, int rounds, TissueFit& fit) {
  constexpr int n = TissueLight::kSize;
  for (int round = 0; round < rounds; ++round) {
    const TissueSystem system(view, view.rows(fit.light), Prior(start, fit), fit);
    fit.light += solve_symmetric(system.normal.bottomRightCorner<n, n>(), system.right.tail<n>());
  }
}

// One step of pose and light; no longer than the picture can be trusted to be straight.
bool step(View& view, const RegisteredSurface& surface, const ObjectPose& start, TissueFit& fit) {
  constexpr double kLongest_mm = 4, kLargest_rad = 0.06, kFarthestLamp_mm = 20;
  const TissueSystem system(view, view.rows(fit.light), Prior(start, fit), fit);
  Column delta = solve_symmetric(system.normal, system.right);
  const double too_far =
      std::max(delta.segment<3>(3).norm() / kLongest_mm, delta.head<3>().norm() / kLargest_rad);
  if (too_far > 1) delta /= too_far;
  if (!delta.allFinite()) return false;
  fit.pose = moved(fit.pose, delta.head<kMotion>());
  fit.light += delta.tail<TissueLight::kSize>();
  for (const int lamp : {TissueLight::kLampX, TissueLight::kLampY})
    fit.light[lamp] = std::clamp(fit.light[lamp], -kFarthestLamp_mm, kFarthestLamp_mm);
  return fit.pose.center_camera_mm.z() > 0.2 * surface.radius_mm();
}

// Gauss–Newton over pose, light and hue at once, the overlap drawn anew at every step. The start
// holds the pose, as softly as 10 mm and 7°: what a flat patch cannot tell stays as it was given.
// Albedo that shading and hue leave unexplained is noise that neighbours share, so that pixels
// count as far fewer than they are.
void climb_tissue(const RegisteredSurface& surface, const TissueLevel& level,
                  const ObjectPose& start, int steps, TissueFit& fit) {
  constexpr double kFarthest_mm = 25, kFarthest_rad = 0.35;
  const double reference_mm = start.center_camera_mm.norm();
  for (int i = 0; i <= steps; ++i) {
    View view(surface, level, fit.pose, reference_mm);
    fit.usable = view.usable();
    if (!fit.usable) return;
    if (i == 0) settle_light(view, start, 3, fit);
    if (i == steps) {
      settle_light(view, start, 2, fit);
      return;
    }
    const Motion from_start = motion_between(start, fit.pose);
    fit.usable = from_start.head<3>().norm() < kFarthest_rad &&
                 from_start.tail<3>().norm() < kFarthest_mm && step(view, surface, start, fit);
    if (!fit.usable) return;
  }
}

constexpr int kFinestTissueSide =
    500;  // pixels: finer than this, texture drowns all but the outlines

// A tenth of what the start shows: darker pixels count less and less.
double darkness(const RegisteredSurface& surface, const PhotoLevel& level, const ObjectPose& pose) {
  constexpr double kShare = 0.1, kLeast = 0.004;
  const ShadingBasis basis(LightModel::camera, pose.center_camera_mm.norm());
  Prediction p;
  predict(surface, level, pose, 1, basis, basis.first_weights(), {}, p);
  std::vector<float> luminance;
  for (const WeightedPixel& pixel : overlap(level, p, 5))
    luminance.push_back(level.luminance[level.index(pixel.x, pixel.y)]);
  return std::max(kLeast, kShare * median(std::move(luminance)));
}

std::vector<ObjectPose> places_round(const ObjectPose& start) {
  constexpr int kPlaces = 24;
  constexpr double kTurn_rad = 0.12, kShift_mm = 7;
  RandomStream random(20040902);
  std::vector<ObjectPose> places = {start};
  for (int i = 0; i < kPlaces; ++i) {
    Motion motion;
    for (int j = 0; j < 6; ++j) motion[j] = random.normal();
    motion.head<3>() *= kTurn_rad / motion.head<3>().norm();
    motion.tail<3>() *= kShift_mm / motion.tail<3>().norm();
    places.push_back(moved(start, motion));
  }
  return places;
}

bool apart(const TissueFit& a, const TissueFit& b) {
  constexpr double kTurn_rad = 0.03, kShift_mm = 2;
  const Motion motion = motion_between(a.pose, b.pose);
  return motion.head<3>().norm() > kTurn_rad || motion.tail<3>().norm() > kShift_mm;
}

// Less of a surface is easily explained: what has slid out of the picture is no match.
void drop_those_that_show_little(std::vector<TissueFit>& fits) {
  constexpr double kLeastShare = 0.6;  // of what the others show
  std::erase_if(fits, [](const TissueFit& fit) { return !fit.usable; });
  std::vector<double> shown;
  for (const TissueFit& fit : fits) shown.push_back(fit.pixels);
  const double least = kLeastShare * median(std::move(shown));
  std::erase_if(fits, [&](const TissueFit& fit) { return fit.pixels < least; });
}

struct Stage {
  int level, steps;
  std::size_t kept;  // of the fits, for the next one
};

std::vector<Stage> stages(const std::vector<PhotoLevel>& pyramid) {
  const int coarsest = static_cast<int>(pyramid.size()) - 1;
  std::vector<Stage> all = {{coarsest, 6, 12}, {coarsest, 10, 4}};
  for (int i = coarsest - 1; i >= 0; --i) {
    const Intrinsics& lens = pyramid[i].intrinsics;
    if (std::max(lens.width, lens.height) > kFinestTissueSide) break;
    all.push_back({i, i + 1 == coarsest ? 10 : 5, 1});
  }
  return all;
}

}  // namespace

std::optional<ObjectPose> search_tissue(const RegisteredSurface& surface, const Rgb8Image& photo,
                                        const std::vector<PhotoLevel>& pyramid,
                                        const ObjectPose& start, const RunContext& context) {
  const int coarsest = static_cast<int>(pyramid.size()) - 1;
  const double dark = darkness(surface, pyramid[coarsest], start);
  std::vector<TissueFit> fits;
  for (const ObjectPose& place : places_round(start)) fits.push_back({.pose = place});
  for (const Stage& stage : stages(pyramid)) {
    const PhotoLevel& level = pyramid[stage.level];
    const TissueLevel tissue{level, log_hues(photo, level), dark};
    parallel_for(std::size_t{0}, fits.size(), [&](std::size_t i) {
      context.throw_if_cancelled();
      climb_tissue(surface, tissue, start, stage.steps, fits[i]);
    });
    drop_those_that_show_little(fits);
    fits = best_apart(
        std::move(fits), stage.kept, [](const TissueFit& fit) { return fit.cost; }, apart);
    if (fits.empty()) return std::nullopt;
  }
  return fits.front().pose;
}

}  // namespace organbake
