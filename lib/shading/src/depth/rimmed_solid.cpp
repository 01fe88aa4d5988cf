// SPDX-License-Identifier: GPL-3.0-or-later
// A solid in front of a plain ground under distant light: its squared height solves a Poisson
// equation within the rim, which meets the rim vertically as solids do, and is then fitted to the
// image by Gauss–Newton. A height itself has an infinite slope there, that no grid holds.
#include "depth/rimmed_solid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "organbake/shading/distant.h"
#include "organbake/shading/grid_filters.h"
#include "organbake/shading/masks.h"
#include "solvers/first_order_equations.h"

namespace organbake {
namespace {

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

}  // namespace

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

}  // namespace organbake
