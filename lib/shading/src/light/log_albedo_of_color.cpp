// SPDX-License-Identifier: GPL-3.0-or-later
// Albedo from colour alone: shading changes brightness and leaves chromaticity, so that steps of
// brightness that go with steps of chromaticity are steps of albedo. Least absolute deviations,
// because many of the steps are shading and must not pull.
#include "light/log_albedo_of_color.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "masks/every_second.h"
#include "organbake/image/srgb.h"
#include "organbake/shading/grid_filters.h"

namespace organbake {
namespace {

// Below this share of the mean brightness a colour is mostly noise, and is drawn to the mean.
constexpr float kDark = 0.1F;
// Chromaticities that differ less than this are one tissue: their pairs count little.
constexpr double kSameColour = 0.02;
constexpr double kMostLog = 1.5;  // tissues differ by a factor of 4.5 at most

// Red and green shares of the smoothed linear colour, less their means.
struct Chromaticity {
  Plane red, green;
  Eigen::Vector2d at(std::size_t k) const { return {red.values[k], green.values[k]}; }
};

Chromaticity chromaticity_of(const Rgb8Image& frame, const Mask& inside) {
  Plane linear[3];
  double mean[3] = {}, count = 0;
  for (int c = 0; c < 3; ++c) {
    Plane plane(frame.width, frame.height);
    for (std::size_t k = 0; k < plane.size(); ++k)
      plane.values[k] = linear_from_srgb8()[frame.pixels[3 * k + c]];
    linear[c] = box_mean(plane, inside, std::max(1, frame.width / 160));
  }
  for (std::size_t k = 0; k < inside.size(); ++k) {
    if (!inside.values[k]) continue;
    for (int c = 0; c < 3; ++c) mean[c] += linear[c].values[k];
    ++count;
  }
  const double all = mean[0] + mean[1] + mean[2];
  Chromaticity colour{Plane(frame.width, frame.height), Plane(frame.width, frame.height)};
  if (!(all > 0)) return colour;
  const float red = static_cast<float>(mean[0] / all), green = static_cast<float>(mean[1] / all);
  const float dark = kDark * static_cast<float>(all / count);
  for (std::size_t k = 0; k < colour.red.size(); ++k) {
    const float sum = linear[0].values[k] + linear[1].values[k] + linear[2].values[k];
    const float counts = sum * sum / (sum * sum + dark * dark) / std::max(sum, 1e-6F);
    colour.red.values[k] = counts * (linear[0].values[k] - red * sum);
    colour.green.values[k] = counts * (linear[1].values[k] - green * sum);
  }
  return colour;
}

struct Step {
  Eigen::Vector2d colour;
  double brightness;  // difference of ln intensity
  double weight;
};

std::vector<Step> steps_between(const Chromaticity& colour, const Plane& intensity,
                                const Mask& inside) {
  const int reach = std::max(2, intensity.width / 80);
  const Plane smooth = box_mean(intensity, inside, std::max(1, intensity.width / 160));
  std::vector<Step> steps;
  const auto compare = [&](int x0, int y0, int x1, int y1) {
    if (x1 >= intensity.width || y1 >= intensity.height) return;
    if (!inside.at(x0, y0) || !inside.at(x1, y1)) return;
    const float one = smooth.at(x0, y0), other = smooth.at(x1, y1);
    if (one <= 0 || other <= 0) return;
    const Eigen::Vector2d step = colour.at(smooth.index(x1, y1)) - colour.at(smooth.index(x0, y0));
    const double size2 = step.squaredNorm();
    steps.push_back(
        {step, std::log(double(other) / one), size2 / (size2 + kSameColour * kSameColour)});
  };
  for (int y = 0; y < intensity.height; y += 2)
    for (int x = 0; x < intensity.width; x += 2) {
      compare(x, y, x + reach, y);
      compare(x, y, x, y + reach);
    }
  return steps;
}

// Least absolute deviations by reweighting, drawn to zero where there is little colour.
Eigen::Vector2d slopes_of(const std::vector<Step>& steps) {
  constexpr int kPasses = 20;
  constexpr double kSmallest = 0.02;  // deviations below this count as squares
  constexpr double kPrior = 1e-5;     // per pair: a tenth of kSameColour²
  Eigen::Vector2d slopes = Eigen::Vector2d::Zero();
  for (int pass = 0; pass < kPasses; ++pass) {
    Eigen::Matrix2d normal =
        Eigen::Matrix2d::Identity() * (kPrior * static_cast<double>(steps.size()) + 1e-12);
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (const Step& step : steps) {
      const double off = step.brightness - step.colour.dot(slopes);
      const double weight = step.weight / std::sqrt(off * off + kSmallest * kSmallest);
      normal += weight * step.colour * step.colour.transpose();
      right += weight * step.brightness * step.colour;
    }
    slopes = normal.ldlt().solve(right);
  }
  return slopes;
}

}  // namespace

Plane log_albedo_of_color(const Rgb8Image& frame, const Plane& intensity, const Mask& inside) {
  const Chromaticity colour = chromaticity_of(frame, inside);
  const Eigen::Vector2d slopes = slopes_of(steps_between(colour, intensity, inside));
  Plane log_albedo(frame.width, frame.height);
  for (std::size_t k = 0; k < log_albedo.size(); ++k)
    log_albedo.values[k] =
        static_cast<float>(kMostLog * std::tanh(slopes.dot(colour.at(k)) / kMostLog));
  return log_albedo;
}

}  // namespace organbake
