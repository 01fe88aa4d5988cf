// SPDX-License-Identifier: GPL-3.0-or-later
#include "shading/log_range_fit.h"

#include <algorithm>
#include <cmath>

#include "shading/first_order_equations.h"

namespace organbake {
namespace {

constexpr double kSettled = 2e-5;  // an outer step that moves v less (mean) ends the fit

// d ln M = −(2δ + b·∇δ) at v. The model, not the image, stands in the weight: dark pixels, whose
// noise is as large as they are, stay unbiased. Returns the root mean square misfit.
double linearise(const ShadedImage& image, double model_error, const Plane& v,
                 FirstOrderEquations& equations) {
  double sum = 0, count = 0;
  const RayGrid& rays = image.rays;
  const int width = v.width, height = v.height;
  for (int row = 0; row < height; ++row) {
    const double y = rays.y(row);
    const double span_y = FirstOrderEquations::span(row, height) * rays.step_y;
    for (int column = 0; column < width; ++column) {
      const double x = rays.x(column);
      const double span_x = FirstOrderEquations::span(column, width) * rays.step_x;
      const double p = derivative_at(&v.values[v.index(0, row)], column, width, 1) / rays.step_x;
      const double q = derivative_at(&v.values[column], row, height, width) / rays.step_y;
      const double c = 1 + x * x + y * y, along = x * p + y * q;
      const double g = c * (p * p + q * q + along * along);
      const double model = std::exp(-2.0 * v.at(column, row)) / std::sqrt(1 + g);
      const std::size_t k = v.index(column, row);
      equations.slope_x.values[k] = static_cast<float>(c * (p + along * x) / (1 + g) / span_x);
      equations.slope_y.values[k] = static_cast<float>(c * (q + along * y) / (1 + g) / span_y);
      double w = 0, misfit = 0;
      if (image.inside.values[k]) {
        const double model2 = model * model;
        w = model2 / (image.variance.values[k] + model_error * model_error * model2);
        misfit = std::clamp(1 - image.intensity.values[k] / model, -1.5, 1.5);
        sum += misfit * misfit;
        ++count;
      }
      equations.weight.values[k] = static_cast<float>(w);
      equations.target.values[k] = static_cast<float>(w * misfit);
    }
  }
  return std::sqrt(sum / std::max(1.0, count));
}

}  // namespace

FitSummary fit_log_range(const ShadedImage& image, const RangeFitOptions& options, Plane& v) {
  const RayGrid& rays = image.rays;
  FirstOrderEquations equations(v.width, v.height, rays.step_x, rays.step_y, 2);
  // Noise of σ² per pixel is a power of σ²h² per area; bending, too, is summed per pixel.
  equations.set_bending(rays.step_x * rays.step_y / (options.roughness * options.roughness));
  Plane delta(v.width, v.height);
  FitSummary summary;
  // ln r never moves by more than this in one step: the linearisation holds no farther.
  constexpr float kLongestStep = 0.25F;
  for (int outer = 0; outer < options.outer_steps; ++outer) {
    summary.misfit = linearise(image, options.model_error, v, equations);
    summary.inner_steps += equations.solve(v, options.inner_steps, delta);
    double change = 0;
    for (std::size_t k = 0; k < v.size(); ++k) {
      const float step = std::clamp(delta.values[k], -kLongestStep, kLongestStep);
      if (!std::isfinite(step)) continue;
      v.values[k] += step;
      change += std::abs(step);
    }
    if (change / std::max<std::size_t>(1, v.size()) < kSettled) break;
  }
  return summary;
}

}  // namespace organbake
