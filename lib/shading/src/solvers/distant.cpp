// SPDX-License-Identifier: GPL-3.0-or-later
// Shape from shading for a distant light by regularised least squares, from several starts. One
// picture allows several surfaces (convex and concave ones shade alike): each start leads to one,
// and the one that explains the picture with the least bending is taken.
#include "organbake/shading/distant.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/shading/grid_filters.h"
#include "organbake/shading/masks.h"
#include "solvers/first_order_equations.h"

namespace organbake {
namespace {

// A solid in front of a plain ground under distant light: its squared height solves a Poisson
// equation within the rim, which meets the rim vertically as solids do, and is then fitted to the
// image by Gauss–Newton. A height itself has an infinite slope there, that no grid holds.

struct RimmedSolid {
  Plane depth;          // Z, pixels, away from the camera; 0 on the ground
  double misfit = 0;    // root mean square of I − R on the solid, off its rim
  int refinements = 0;  // conjugate-gradient steps
};

// Pixels as bright as a plane that faces the camera and connected with the border. Where the
// solid's own isophote of that brightness meets the rim, the ground would leak in: necks narrower
// than the opening are closed.
Mask plain_ground(const ShadedImage& image, double brightness, double noise) {
  constexpr double kLeastTolerance = 0.02, kDeviations = 4;
  constexpr int kNeck = 2;  // pixels, half
  const int smoothing = kDeviations * noise > kLeastTolerance ? 1 : 0;
  const Plane smooth = box_mean(image.intensity, image.inside, smoothing);
  const auto alike = [&](const Plane& plane, double sigma) {
    const double tolerance = std::max(kLeastTolerance, kDeviations * sigma);
    Mask mask(plane.width, plane.height);
    for (std::size_t k = 0; k < mask.size(); ++k)
      mask.values[k] = image.inside.values[k] && std::abs(plane.values[k] - brightness) < tolerance;
    return mask;
  };
  Mask border(smooth.width, smooth.height);
  for (int y = 0; y < border.height; ++y)
    for (int x = 0; x < border.width; ++x)
      border.at(x, y) = x == 0 || y == 0 || x + 1 == border.width || y + 1 == border.height;
  const Mask core = eroded(alike(smooth, noise / (2 * smoothing + 1)), kNeck);
  return common(dilated(regions_touching(core, border), kNeck + smoothing),
                alike(image.intensity, noise));
}

// −Δu = 1 off the ground, u = 0 on it; the frame's edge is level. Successive over-relaxation.
Plane membrane(const Mask& ground) {
  const int w = ground.width, h = ground.height, longest = std::max(w, h);
  const float omega = static_cast<float>(2 / (1 + std::numbers::pi / longest));
  Plane u(w, h);
  for (int sweep = 0; sweep < 4 * longest; ++sweep)
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        if (ground.at(x, y)) continue;
        float sum = 1, neighbours = 0;
        const auto add = [&](int at_x, int at_y) {
          sum += u.at(at_x, at_y);
          ++neighbours;
        };
        if (x > 0) add(x - 1, y);
        if (y > 0) add(x, y - 1);
        if (x + 1 < w) add(x + 1, y);
        if (y + 1 < h) add(x, y + 1);
        u.at(x, y) += omega * (sum / neighbours - u.at(x, y));
      }
  return u;
}

class SwellFit {
 public:
  SwellFit(const ShadedImage& image, const Eigen::Vector3d& toward, const Mask& ground)
      : image_(image),
        toward_(toward),
        u_(membrane(ground)),
        counts_(without(image.inside, dilated(ground, 1))),
        swell_(u_.width, u_.height),
        equations_(u_.width, u_.height, 1, 1, /*zero_order=*/1) {}

  RimmedSolid fit() {
    constexpr int kLinearisations = 8, kInnerSteps = 200;
    constexpr float kLongestStep = 0.5F;
    start();
    RimmedSolid solid;
    Plane delta(u_.width, u_.height);
    equations_.set_bending(kBending);
    for (int i = 0; i < kLinearisations; ++i) {
      linearise();
      solid.refinements += equations_.solve(swell_, kInnerSteps, delta);
      for (std::size_t k = 0; k < delta.size(); ++k)
        if (std::isfinite(delta.values[k]))
          swell_.values[k] += std::clamp(delta.values[k], -kLongestStep, kLongestStep);
    }
    solid.misfit = linearise();
    solid.depth = std::move(squared_);
    for (float& value : solid.depth.values) value = -std::sqrt(value);
    return solid;
  }

 private:
  // Measured on clean vases and spheres of 128²: from 0.1 to 10 the errors change by less than
  // 0.5 pixels, in either direction.
  static constexpr double kBending = 3;

  void start() {
    double least = std::numeric_limits<double>::infinity(), best = 0;
    for (double factor = 0.5; factor < 8; factor *= 1.1) {  // 2: a cylinder; 4: a sphere
      const auto swell = static_cast<float>(std::log(factor));
      std::fill(swell_.values.begin(), swell_.values.end(), swell);
      const double misfit = linearise();
      if (misfit < least) least = misfit, best = swell;
    }
    std::fill(swell_.values.begin(), swell_.values.end(), static_cast<float>(best));
  }

  // R at ε, with g = h² and p = −g_x / 2h:  δp = ½ p δε − ½ h δε_x. Returns the misfit.
  double linearise() {
    squared_ = u_;
    for (std::size_t k = 0; k < u_.size(); ++k) squared_.values[k] *= std::exp(swell_.values[k]);
    double sum = 0, count = 0;
    for (int y = 0; y < u_.height; ++y)
      for (int x = 0; x < u_.width; ++x) {
        const std::size_t k = u_.index(x, y);
        equations_.weight.values[k] = equations_.target.values[k] = 0;
        equations_.slope_x.values[k] = equations_.slope_y.values[k] = 0;
        if (!counts_.values[k]) continue;
        const double misfit = linearise_pixel(x, y);
        sum += misfit * misfit;
        ++count;
      }
    return std::sqrt(sum / std::max(1.0, count));
  }

  double linearise_pixel(int x, int y) {
    const int left = std::max(0, x - 1), right = std::min(u_.width - 1, x + 1);
    const int up = std::max(0, y - 1), down = std::min(u_.height - 1, y + 1);
    const double span_x = std::max(1, right - left), span_y = std::max(1, down - up);
    const Plane& g = squared_;
    const double h = std::sqrt(g.at(x, y));
    if (!(h > 0)) return 0;
    const double p = -(g.at(right, y) - g.at(left, y)) / span_x / (2 * h);
    const double q = -(g.at(x, down) - g.at(x, up)) / span_y / (2 * h);
    const double w2 = 1 + p * p + q * q, w = std::sqrt(w2), r = lambert(p, q, toward_);
    const std::size_t k = u_.index(x, y);
    const double intensity = image_.intensity.values[k];
    if (r < 0 && intensity <= 0) return 0;  // black says only that it looks away from the light
    const double misfit = intensity - std::max(r, 0.0);
    const double r_p = toward_.x() / w - r * p / w2, r_q = toward_.y() / w - r * q / w2;
    // The equations' own term by δε is 1: each is divided by what it should be, and weighs its
    // square.
    constexpr double kLeast = 1e-2, kEdge = 0.1;
    const double by_value = 0.5 * (r_p * p + r_q * q);
    const double a = std::copysign(std::max(kLeast, std::abs(by_value)), by_value);
    const double weight = a * a / (1 + misfit * misfit / (kEdge * kEdge));
    equations_.weight.values[k] = static_cast<float>(weight);
    equations_.target.values[k] = static_cast<float>(weight * misfit / a);
    equations_.slope_x.values[k] = static_cast<float>(-0.5 * h * r_p / a / span_x);
    equations_.slope_y.values[k] = static_cast<float>(-0.5 * h * r_q / a / span_y);
    return misfit;
  }

  const ShadedImage& image_;
  const Eigen::Vector3d& toward_;
  Plane u_;
  Mask counts_;    // off the ground and the rim's own pixels
  Plane swell_;    // ε
  Plane squared_;  // h²
  FirstOrderEquations equations_;
};

// A round thing in front of a plain ground that faces the camera, lit from afar: along its rim it
// looks away from the camera (the occluding contour of Ikeuchi & Horn 1981), where slopes are
// infinite and no difference of depths can follow them. Its height is therefore sought as
//   h = √(u e^ε),   −Δu = 1 on the solid, u = 0 on the ground,
// which has such a rim for every smooth ε (a sphere and a cylinder have constant ones): first one ε
// for all by least misfit, then ε(x, y) by Gauss–Newton with a bending penalty. Nothing when no
// such ground surrounds anything. The image's intensities are divided by the albedo; `noise` is
// their standard deviation.
std::optional<RimmedSolid> shade_rimmed_solid(const ShadedImage& image,
                                              const Eigen::Vector3d& toward, double noise) {
  constexpr double kLeastShare = 0.05;  // of the picture, ground and solid each
  const Mask ground = plain_ground(image, toward.z(), noise);
  const auto pixels = static_cast<double>(ground.size());
  const double share =
      static_cast<double>(std::count(ground.values.begin(), ground.values.end(), 1)) / pixels;
  if (!(share >= kLeastShare && share <= 1 - kLeastShare)) return std::nullopt;
  return SwellFit(image, toward, ground).fit();
}

constexpr int kDistantBaseSide = 16;
constexpr double kAmbiguousSlant = 10 * std::numbers::pi / 180;

ShadedImage prepared(const Plane& intensity, const Mask& inside, double albedo) {
  const int width = intensity.width, height = intensity.height;
  ShadedImage image{intensity, Plane(width, height, 1), inside, {width, height, 1, 1, 0, 0}};
  for (std::size_t k = 0; k < intensity.size(); ++k) {
    const double value = intensity.values[k] / albedo;
    if (!(std::isfinite(value) && value >= 0)) image.inside.values[k] = 0;
    image.intensity.values[k] =
        image.inside.values[k] ? static_cast<float>(std::min(value, 1.0)) : 0;
  }
  return image;
}

// One linearisation of R at Z; returns the root mean square misfit.
double linearise(const ShadedImage& image, const Eigen::Vector3d& s, const Plane& z,
                 FirstOrderEquations& equations) {
  const double step = image.rays.step_x;
  double sum = 0, count = 0;
  std::vector<double> by_x, by_y;
  for (int row = 0; row < z.height; ++row) {
    derivatives_along(z, row, by_x);
    derivatives_across(z, row, by_y);
    for (int column = 0; column < z.width; ++column) {
      const std::size_t k = z.index(column, row);
      const double p = by_x[column] / step, q = by_y[column] / step;
      const double w2 = 1 + p * p + q * q, w = std::sqrt(w2), r = lambert(p, q, s);
      const double intensity = image.intensity.values[k];
      // Black says only that the surface looks away from the light.
      const double misfit = r < 0 && intensity <= 0 ? 0 : intensity - std::max(r, 0.0);
      const bool counts = image.inside.values[k] && !(r < 0 && intensity <= 0);
      const double span_x = FirstOrderEquations::span(column, z.width) * step;
      const double span_y = FirstOrderEquations::span(row, z.height) * step;
      equations.slope_x.values[k] = static_cast<float>((s.x() / w - r * p / w2) / span_x);
      equations.slope_y.values[k] = static_cast<float>((s.y() / w - r * q / w2) / span_y);
      // Robust: an occluding edge, which no smooth surface explains, must not bend what is beside.
      constexpr double kEdge = 0.1;
      const double weight = counts ? 1 / (1 + (misfit * misfit) / (kEdge * kEdge)) : 0;
      equations.weight.values[k] = static_cast<float>(weight);
      equations.target.values[k] = static_cast<float>(weight * misfit);
      if (!counts) continue;
      sum += misfit * misfit;
      ++count;
    }
  }
  return std::sqrt(sum / std::max(1.0, count));
}

struct Descent {
  Plane z;
  double misfit = 0;
  double bending = 0;  // mean square second difference, per pixel of the level
  int refinements = 0;
};

double bending_of(const Plane& z) {
  double sum = 0;
  for (int y = 1; y + 1 < z.height; ++y)
    for (int x = 1; x + 1 < z.width; ++x) {
      const double xx = z.at(x - 1, y) - 2 * z.at(x, y) + z.at(x + 1, y);
      const double yy = z.at(x, y - 1) - 2 * z.at(x, y) + z.at(x, y + 1);
      sum += xx * xx + yy * yy;
    }
  return sum / std::max<double>(1, static_cast<double>(z.size()));
}

// Most pictures show something in front of a plain ground: the border is held near one depth unless
// it resists (Geman–McClure).
void anchor_border(const Plane& z, double step, Plane& anchor) {
  const double reach = 4 * step;
  for (int y = 0; y < z.height; ++y)
    for (int x = 0; x < z.width; ++x) {
      if (x > 0 && y > 0 && x + 1 < z.width && y + 1 < z.height) continue;
      const double share = z.at(x, y) / reach;
      anchor.at(x, y) = static_cast<float>(1 / (step * step) / std::pow(1 + share * share, 2));
    }
}

void fit_level(const ShadedImage& image, const Eigen::Vector3d& s, double mu_px, int outer,
               int inner, Descent& state) {
  const double step = image.rays.step_x;
  FirstOrderEquations equations(state.z.width, state.z.height, step, step, 0);
  equations.set_bending(mu_px * step * step);
  equations.set_membrane(1e-3 * mu_px);
  Plane delta(state.z.width, state.z.height);
  const float longest = static_cast<float>(2 * step);
  for (int i = 0; i < outer; ++i) {
    state.misfit = linearise(image, s, state.z, equations);
    anchor_border(state.z, step, equations.anchor);
    state.refinements += equations.solve(state.z, inner, delta);
    for (std::size_t k = 0; k < delta.size(); ++k)
      if (std::isfinite(delta.values[k]))
        state.z.values[k] += std::clamp(delta.values[k], -longest, longest);
  }
}

Descent descend(const std::vector<ShadedImage>& levels, const Eigen::Vector3d& s, double roughness,
                Plane start) {
  Descent state{std::move(start), 0, 0, 0};
  const double mu = 0.01 / (roughness * roughness);
  for (std::size_t i = levels.size(); i-- > 0;) {
    if (i + 1 < levels.size())
      state.z = doubled(state.z, levels[i].rays.width, levels[i].rays.height);
    const bool coarsest = i + 1 == levels.size();
    for (double factor = coarsest ? 100 : 1; factor >= 0.01; factor *= 0.1)
      fit_level(levels[i], s, mu * factor, 6, coarsest ? 100 : 60, state);
  }
  state.bending = bending_of(state.z);
  return state;
}

// A paraboloid; height > 0 comes towards the camera in the middle.
Plane dome(int width, int height, double rise) {
  Plane z(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double u = 2 * (x + 0.5) / width - 1, v = 2 * (y + 0.5) / height - 1;
      z.at(x, y) = static_cast<float>(rise * (u * u + v * v));
    }
  return z;
}

void remove_mean(Plane& z) {
  double sum = 0;
  for (float value : z.values) sum += value;
  const float mean = static_cast<float>(sum / std::max<double>(1, double(z.size())));
  for (float& value : z.values) value -= mean;
}

void take_best_sheet(ShadedImage finest, const Eigen::Vector3d& s, double roughness,
                     DistantEstimate& estimate) {
  std::vector<ShadedImage> levels = {std::move(finest)};
  while (std::max(levels.back().rays.width, levels.back().rays.height) > kDistantBaseSide)
    levels.push_back(halved(levels.back()));
  const int width = levels.back().rays.width, height = levels.back().rays.height;
  const double rise = 0.1 * levels.back().rays.step_x * std::max(width, height);
  double best = std::numeric_limits<double>::infinity();
  for (const auto& [name, height_px] :
       {std::pair{"flat", 0.0}, std::pair{"near", rise}, std::pair{"far", -rise}}) {
    Descent state = descend(levels, s, roughness, dome(width, height, height_px));
    const double cost = state.misfit * state.misfit + 1e-3 * state.bending;
    if (!(cost < best)) continue;
    best = cost;
    estimate.branch = name;
    estimate.depth = std::move(state.z);
    estimate.misfit = state.misfit;
    estimate.refinements = state.refinements;
  }
}

// A solid's height has far fewer ways to bend than a sheet's: one that explains the image down to
// its noise is what is there. Measured on the five surfaces of organbench without noise: solids
// leave 0.002–0.007, the others 0.05 and more.
bool take_solid(const ShadedImage& image, const Eigen::Vector3d& s, DistantEstimate& estimate) {
  const double noise = noise_level(image.intensity, image.inside);
  std::optional<RimmedSolid> solid = shade_rimmed_solid(image, s, noise);
  if (!solid || !(solid->misfit <= 0.01 + 1.2 * noise)) return false;
  estimate.branch = "solid";
  estimate.depth = std::move(solid->depth);
  estimate.misfit = solid->misfit;
  estimate.refinements = solid->refinements;
  return true;
}

}  // namespace

void DistantOptions::check() const {
  if (!(light.slant_rad >= 0 && light.slant_rad <= 1.5708))
    throw UsageError("slant is " + to_text(light.slant_rad) +
                     " rad; a light in front of the surface has 0…π/2");
  if (!(albedo > 0 && albedo < 1e9))
    throw UsageError("albedo is " + to_text(albedo) + "; it must be positive");
  if (!(roughness > 0 && roughness < 1e6))
    throw UsageError("roughness is " + to_text(roughness) + "; it must be positive");
}

DistantEstimate shade_distant(const Plane& intensity, const Mask& inside,
                              const DistantOptions& options, const Plane* previous) {
  options.check();
  if (inside.width != intensity.width || inside.height != intensity.height)
    throw BadDataError("shading: image and mask are of different sizes");
  ShadedImage image = prepared(intensity, inside, options.albedo);
  const Eigen::Vector3d s = options.light.toward();
  DistantEstimate estimate;
  estimate.ambiguous = options.light.slant_rad < kAmbiguousSlant;
  if (previous && previous->width == intensity.width && previous->height == intensity.height) {
    Descent state{*previous, 0, 0, 0};
    fit_level(image, s, 1e-4 / (options.roughness * options.roughness), 2, 20, state);
    estimate.branch = "previous";
    estimate.depth = std::move(state.z);
    estimate.misfit = state.misfit;
    estimate.refinements = state.refinements;
    remove_mean(estimate.depth);
    return estimate;
  }
  if (!take_solid(image, s, estimate))
    take_best_sheet(std::move(image), s, options.roughness, estimate);
  if (estimate.depth.size() == 0) estimate.depth = Plane(intensity.width, intensity.height);
  remove_mean(estimate.depth);
  return estimate;
}

Eigen::Vector3d DistantLight::toward() const {
  return {std::cos(tilt_rad) * std::sin(slant_rad), std::sin(tilt_rad) * std::sin(slant_rad),
          std::cos(slant_rad)};
}

DistantLight distant_light(const Eigen::Vector3d& toward) {
  const Eigen::Vector3d s = toward.normalized();
  return {std::atan2(s.y(), s.x()), std::acos(std::clamp(s.z(), -1.0, 1.0))};
}

double lambert(double p, double q, const Eigen::Vector3d& toward) {
  return (p * toward.x() + q * toward.y() + toward.z()) / std::sqrt(1 + p * p + q * q);
}

}  // namespace organbake
