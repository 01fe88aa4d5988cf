// SPDX-License-Identifier: GPL-3.0-or-later
// In sRGB's encoding a sensor's noise is about the same everywhere, and what a gain g makes of it
// is g^0.45 of it: that is what an eye sees, so noise is measured, quieted and limited there.
#include "light/divided_light.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "organbake/core/median.h"
#include "organbake/image/srgb.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/shading/grid_filters.h"

namespace organbake {
namespace {

constexpr float kGamma = 2.2F;
constexpr float kSeen = 2.0F / 255;  // noise that an eye begins to see

// Of white noise the mean of 2×2 pixels has half; what a camera's scaling or a codec has made of it
// hangs together over several.
float noise_in_grains(const Plane& encoded, const Mask& counts) {
  ShadedImage image{encoded, Plane(counts.width, counts.height, 1), counts, {}};
  image.rays.width = counts.width, image.rays.height = counts.height;
  const ShadedImage half = halved(image);
  return static_cast<float>(
      std::max(noise_level(encoded, counts), 2 * noise_level(half.intensity, half.inside)));
}

// Of the encoded green, which of all channels is compressed least; of the darker half, too, whose
// gain a camera may have turned up.
float encoded_noise(const Rgb8Image& frame, const Plane& light, const Mask& counts) {
  Plane green(frame.width, frame.height);
  std::vector<float> lights;
  for (std::size_t k = 0; k < green.size(); ++k) {
    green.values[k] = static_cast<float>(frame.pixels[3 * k + 1]) / 255;
    if (counts.values[k] && light.values[k] > 0) lights.push_back(light.values[k]);
  }
  const float middle = median(std::move(lights));
  Mask dark = counts;
  for (std::size_t k = 0; k < dark.size(); ++k)
    dark.values[k] = counts.values[k] && light.values[k] > 0 && light.values[k] < middle;
  return std::max(noise_in_grains(green, counts), noise_in_grains(green, dark));
}

// Smooth but for edges of more than a few deviations of the noise (bilateral filter; Tomasi &
// Manduchi 1998).
cv::Mat quieted(const cv::Mat& encoded, float noise) {
  constexpr int kDiameter_px = 11;
  constexpr double kEdge = 3, kReach_px = 3;
  cv::Mat smooth;
  cv::bilateralFilter(encoded, smooth, kDiameter_px, kEdge * noise, kReach_px);
  return smooth;
}

}  // namespace

LinearColor divided_by_light(const Rgb8Image& frame, const Plane& light, const Mask& counts) {
  constexpr float kQuieted = 6;  // times less noise after the filter
  const float noise = encoded_noise(frame, light, counts);
  const float damping = std::pow(noise / (2 * kQuieted * kSeen), kGamma);
  cv::Mat encoded;
  cv_view(frame).convertTo(encoded, CV_32FC3, 1.0 / 255);
  const cv::Mat smooth = noise > 0 ? quieted(encoded, noise) : encoded;
  LinearColor color = linear_color(frame);
  for (int y = 0; y < light.height; ++y)
    for (int x = 0; x < light.width; ++x) {
      const std::size_t k = light.index(x, y);
      const float l = light.values[k];
      const float gain = l > 0 ? l / (l * l + damping * damping) : 0;
      // Of the noise's variance after the division what is seen: so much is drawn to the smooth.
      const float louder = noise * std::pow(gain, 1 / kGamma) / kSeen;
      const float share = louder > 1 ? 1 - 1 / (louder * louder) : 0;
      const auto& own = encoded.at<cv::Vec3f>(y, x);
      const auto& quiet = smooth.at<cv::Vec3f>(y, x);
      for (int c = 0; c < 3; ++c) {
        float& value = color[c].values[k];
        if (share > 0) value = linear_from_srgb(own[c] + share * (quiet[c] - own[c]));
        value *= gain;
      }
    }
  return color;
}

}  // namespace organbake
