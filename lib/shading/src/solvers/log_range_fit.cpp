// SPDX-License-Identifier: GPL-3.0-or-later
// Least squares of ln r against the image with a bending energy, by Gauss–Newton with a line
// search. ln r makes fall-off and gain additive, and the error of a step does not hang on the
// distance.
#include "organbake/shading/log_range_fit.h"

#include <algorithm>
#include <cmath>

#include "organbake/shading/grid_filters.h"
#include "solvers/first_order_equations.h"

namespace organbake {
namespace {

constexpr double kSettled = 2e-5;  // an outer step that moves v less (mean) ends the fit

struct Misfit {
  double rms = 0;   // of image / model − 1
  double cost = 0;  // Σ w misfit²
};

// 1 − I/M, and where the image is far brighter than the model the logarithm, which continues it
// smoothly: steps stay in proportion when a start is too dark by a multiple.
double misfit_of(double ratio) {
  constexpr double kFar = 1.5;
  return ratio > kFar ? 1 - kFar - kFar * std::log(ratio / kFar) : 1 - ratio;
}

// d ln M = −(2δ + b·∇δ) at v. The model, not the image, stands in the weight: dark pixels, whose
// noise is as large as they are, stay unbiased.
Misfit linearise(const ShadedImage& image, double model_error, const Plane& v,
                 FirstOrderEquations& equations) {
  Misfit result;
  double shares = 0;
  const RayGrid& rays = image.rays;
  const int width = v.width, height = v.height;
  std::vector<double> by_x, by_y;
  for (int row = 0; row < height; ++row) {
    const double y = rays.y(row);
    const double span_y = FirstOrderEquations::span(row, height) * rays.step_y;
    derivatives_along(v, row, by_x);
    derivatives_across(v, row, by_y);
    for (int column = 0; column < width; ++column) {
      const double x = rays.x(column);
      const double span_x = FirstOrderEquations::span(column, width) * rays.step_x;
      const double p = by_x[column] / rays.step_x, q = by_y[column] / rays.step_y;
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
        misfit = misfit_of(image.intensity.values[k] / model);
        result.cost += w * misfit * misfit;
        // By how many pixels of the frame it is the mean of: a mask's rim leaves some of a few,
        // and what a mask has missed is all that they show.
        const double share = 1 / image.variance.values[k];
        result.rms += share * misfit * misfit;
        shares += share;
      }
      equations.weight.values[k] = static_cast<float>(w);
      equations.target.values[k] = static_cast<float>(w * misfit);
    }
  }
  result.rms = shares > 0 ? std::sqrt(result.rms / shares) : 0;
  return result;
}

class RangeFit {
 public:
  RangeFit(const ShadedImage& image, const RangeFitOptions& options, Plane& v,
           const HeldRange* held)
      : image_(image),
        options_(options),
        v_(v),
        equations_(v.width, v.height, image.rays.step_x, image.rays.step_y, 2),
        delta_(v.width, v.height) {
    // Noise of σ² per pixel is a power of σ²h² per area; bending, too, is summed per pixel.
    equations_.set_bending(image.rays.step_x * image.rays.step_y /
                           (options.roughness * options.roughness));
    if (held) equations_.hold(held->log_range, held->weight);
  }

  FitSummary run() {
    FitSummary summary;
    evaluate();
    for (int outer = 0; outer < options_.outer_steps; ++outer) {
      summary.inner_steps += equations_.solve(v_, options_.inner_steps, delta_);
      if (step() < kSettled) break;
    }
    summary.misfit = rms_;
    return summary;
  }

 private:
  void evaluate() {
    const Misfit misfit = linearise(image_, options_.model_error, v_, equations_);
    rms_ = misfit.rms;
    cost_ = misfit.cost + equations_.penalty(v_);
  }

  // Goes as far along δ as the cost falls; returns how far v moved (mean). Where the linearisation
  // does not hold, the whole step ends in a surface of bumps whose slopes make up for a brightness
  // that is wrong all over.
  double step() {
    // ln r never moves by more than this in one step: the linearisation holds no farther.
    constexpr float kLongestStep = 0.25F, kShortest = 0.1F;
    const Plane before = v_;
    const double cost_before = cost_, rms_before = rms_;
    for (float share = 1; share > kShortest; share *= 0.5F) {
      double change = 0;
      for (std::size_t k = 0; k < v_.size(); ++k) {
        const float move = share * std::clamp(delta_.values[k], -kLongestStep, kLongestStep);
        if (!std::isfinite(move)) continue;
        v_.values[k] = before.values[k] + move;
        change += std::abs(move);
      }
      evaluate();
      if (cost_ < cost_before) return change / std::max<double>(1, static_cast<double>(v_.size()));
    }
    v_ = before;
    rms_ = rms_before;
    return 0;  // which ends the fit
  }

  const ShadedImage& image_;
  const RangeFitOptions& options_;
  Plane& v_;
  FirstOrderEquations equations_;
  Plane delta_;
  double rms_ = 0, cost_ = 0;
};

// A length, in normalised coordinates, over which curvature keeps its sign. Measured on the near
// surfaces of organbench: from 0.03 to 0.06 errors under 1 % of noise change by a twentieth; under
// 3 % the steepest surface gains a fifth by the larger, the flattest loses a twentieth.
constexpr double kCurvatureLength = 0.04;
// Less would smooth away folds that are few but sharp (the phantom's laparoscopy: 0.6 % for 0.3 %).
constexpr double kLeast = 0.25, kMost = 1;

}  // namespace

FitSummary fit_log_range(const ShadedImage& image, const RangeFitOptions& options, Plane& v,
                         const HeldRange* held) {
  return RangeFit(image, options, v, held).run();
}

double roughness_of(const Plane& v, const ShadedImage& image) {
  const double per_xx = 1 / (image.rays.step_x * image.rays.step_x);
  const double per_yy = 1 / (image.rays.step_y * image.rays.step_y);
  const double per_xy = 0.25 / (image.rays.step_x * image.rays.step_y);
  double sum = 0, count = 0;
  // Not at the border, where the penalty alone holds the surface.
  for (int y = 2; y + 2 < v.height; ++y)
    for (int x = 2; x + 2 < v.width; ++x) {
      if (!image.inside.at(x, y)) continue;
      const double xx = per_xx * (v.at(x - 1, y) - 2 * v.at(x, y) + v.at(x + 1, y));
      const double yy = per_yy * (v.at(x, y - 1) - 2 * v.at(x, y) + v.at(x, y + 1));
      const double xy = per_xy * (v.at(x + 1, y + 1) - v.at(x - 1, y + 1) - v.at(x + 1, y - 1) +
                                  v.at(x - 1, y - 1));
      sum += xx * xx + 2 * xy * xy + yy * yy;
      ++count;
    }
  const double curvature = std::sqrt(sum / std::max(1.0, count));
  // Written so that NaN gives the least.
  return curvature > 0 ? std::clamp(kCurvatureLength * curvature, kLeast, kMost) : kLeast;
}

}  // namespace organbake
