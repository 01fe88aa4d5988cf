// SPDX-License-Identifier: GPL-3.0-or-later
// Shape from shading for a distant light by regularised least squares, from several starts. One
// picture allows several surfaces (convex and concave ones shade alike): each start leads to one,
// and the one that explains the picture with the least bending is taken.
#include "organbake/shading/distant.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "depth/rimmed_solid.h"
#include "organbake/core/error.h"
#include "organbake/core/text.h"
#include "organbake/shading/grid_filters.h"
#include "solvers/first_order_equations.h"

namespace organbake {
namespace {

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
