// SPDX-License-Identifier: GPL-3.0-or-later
// Logarithms of ratios of colour channels: what brightness and exposure do not change.
#include "color/tissue_colors.h"

#include <algorithm>
#include <cmath>

#include "organbake/image/srgb.h"

namespace organbake {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kBlack = 0.003f;  // of the range: below, a colour is the sensor's

Vector3f mean_color(const Rgb8Image& photo, int left, int top, int side) {
  constexpr int kBlown = 250;
  const auto& linear = linear_from_srgb8();
  Vector3f sum = Vector3f::Zero();
  int count = 0;
  for (int y = top; y < top + side; ++y)
    for (int x = left; x < left + side; ++x) {
      const std::uint8_t* rgb = photo.at(x, y);
      if (std::max({rgb[0], rgb[1], rgb[2]}) >= kBlown) continue;
      sum += Vector3f(linear[rgb[0]], linear[rgb[1]], linear[rgb[2]]);
      ++count;
    }
  return count > 0 ? Vector3f(sum / static_cast<float>(count)) : sum;
}

}  // namespace

std::vector<Vector2f> log_hues(const Rgb8Image& photo, const PhotoLevel& level) {
  std::vector<Vector2f> hues(level.luminance.size());
  for (int y = 0; y < level.intrinsics.height; ++y)
    for (int x = 0; x < level.intrinsics.width; ++x) {
      const Vector3f c =
          mean_color(photo, x * level.factor, y * level.factor, level.factor).array() + kBlack;
      hues[level.index(x, y)] = {std::log(c[0] / c[1]), std::log(c[1] / c[2])};
    }
  return hues;
}

std::vector<TissueLight::Hues> hue_numbers(const PhotoLevel& level,
                                           const std::vector<Vector2f>& hues, const Prediction& p,
                                           const std::vector<WeightedPixel>& pixels) {
  constexpr double kLeastSpread = 0.05, kFarthest = 3;
  Eigen::Array2d sum(0, 0), sum2(0, 0);
  double weight = 0;
  for (const WeightedPixel& pixel : pixels) {
    const double w = pixel.trust * p.coverage[p.index(pixel.x, pixel.y)];
    const Eigen::Array2d h = hues[level.index(pixel.x, pixel.y)].cast<double>();
    weight += w;
    sum += w * h;
    sum2 += w * h * h;
  }
  const Eigen::Array2d mean = sum / std::max(1e-9, weight);
  const Eigen::Array2d spread =
      (sum2 / std::max(1e-9, weight) - mean * mean).max(0).sqrt().max(kLeastSpread);
  std::vector<TissueLight::Hues> numbers;
  numbers.reserve(pixels.size());
  for (const WeightedPixel& pixel : pixels) {
    const Eigen::Array2d h =
        ((hues[level.index(pixel.x, pixel.y)].cast<double>().array() - mean) / spread)
            .max(-kFarthest)
            .min(kFarthest);
    TissueLight::Hues number;
    number << h[0], h[1], h[0] * h[0] - 1, h[1] * h[1] - 1, h[0] * h[1];
    numbers.push_back(number);
  }
  return numbers;
}

}  // namespace organbake
