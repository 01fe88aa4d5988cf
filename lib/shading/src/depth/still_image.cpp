// SPDX-License-Identifier: GPL-3.0-or-later
// Whether two frames differ by more than their noise: squared differences of coarse images in units
// of their variance. Where they do not, the depth of the frame before stands, bit for bit, and a
// still scene does not flicker.
#include "depth/still_image.h"

#include <algorithm>
#include <limits>

namespace organbake {
namespace {

// Pixels enough to tell where something moves, and each the mean of enough others.
constexpr int kSide = 64;
// Squared differences in units of their variance. Noise alone gives 1 on average and, among a few
// thousand pixels, about 16 at most; as the noise is estimated, 0.5 to 1.4 and 24 were seen. Of the
// phantom's laparoscopy neighbouring frames give 37, and 785.
constexpr double kMostOnAverage = 1.5, kMostOfOne = 36;
// Highlights and instruments that come or go: of the pixels, those that count in one image only.
constexpr double kMostChanged = 0.01;
// A pixel at a mask's rim is the mean of what counts in it, which noise alone makes other parts of
// it in each frame. Its variance tells: it is that of fewer pixels. Of the rest this share will do.
constexpr double kWhole = 1.5, kLeastWhole = 0.5;

// Noise of colour passes into the albedo that is divided out, by this share of the brightness; it
// is smooth, so that the mean of many pixels does not lessen it.
constexpr double kAlbedoNoise = 0.003;

double least_variance(const CoarseImage& image) {
  float least = std::numeric_limits<float>::max();
  for (std::size_t k = 0; k < image.inside.size(); ++k)
    if (image.inside.values[k]) least = std::min(least, image.variance.values[k]);
  return least;
}

}  // namespace

CoarseImage coarse_image(const std::vector<ShadedImage>& levels) {
  const auto coarse = std::find_if(levels.begin(), levels.end() - 1, [](const ShadedImage& level) {
    return std::max(level.rays.width, level.rays.height) <= kSide;
  });
  return {coarse->intensity, coarse->variance, coarse->inside};
}

bool shows_the_same(const CoarseImage& before, const CoarseImage& now) {
  if (before.inside.width != now.inside.width || before.inside.height != now.inside.height)
    return false;
  const double most_before = kWhole * least_variance(before),
               most_now = kWhole * least_variance(now);
  double sum = 0, largest = 0;
  std::size_t changed = 0, compared = 0, either = 0;
  for (std::size_t k = 0; k < now.inside.size(); ++k) {
    const bool in_before = before.inside.values[k] != 0, in_now = now.inside.values[k] != 0;
    either += in_before || in_now;
    changed += in_before != in_now;
    if (!in_before || !in_now) continue;
    if (before.variance.values[k] > most_before || now.variance.values[k] > most_now) continue;
    const double difference = double(now.intensity.values[k]) - before.intensity.values[k];
    const double of_albedo = kAlbedoNoise * now.intensity.values[k];
    const double variance =
        double(now.variance.values[k]) + before.variance.values[k] + of_albedo * of_albedo;
    const double squared = difference * difference / variance;
    sum += squared;
    largest = std::max(largest, squared);
    ++compared;
  }
  return either > 0 && double(compared) >= kLeastWhole * double(either) &&
         double(changed) <= kMostChanged * double(either) &&
         sum <= kMostOnAverage * double(compared) && largest <= kMostOfOne;
}

}  // namespace organbake
