// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "disparity.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/stereo/local_planes.h"

namespace organbake {

void guess_unknown(const Mask& wanted, Disparity& disparity) {
  const int width = wanted.width, height = wanted.height;
  constexpr float kEnough = 0.02F;  // of the window
  Mask guessed = disparity.known;
  Plane weight(width, height);
  for (std::size_t k = 0; k < weight.size(); ++k) weight.values[k] = disparity.known.values[k];
  // Small windows first: what is far off says less.
  for (int radius = 4; radius < 2 * std::max(width, height); radius *= 3) {
    bool missing = false;
    for (std::size_t k = 0; k < wanted.size() && !missing; ++k)
      missing = wanted.values[k] && !guessed.values[k];
    if (!missing) return;
    const LocalPlanes planes(disparity.px, weight, radius);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        if (guessed.at(x, y) || !wanted.at(x, y) || planes.weight(x, y) < kEnough) continue;
        disparity.px.at(x, y) = planes.at(x, y).value;
        guessed.at(x, y) = 1;
      }
  }
}

Disparity doubled(const Disparity& half, int width, int height) {
  Disparity full{Plane(width, height), Mask(width, height)};
  cv::Mat weight, value, share, guess;
  cv_view(half.known).convertTo(weight, CV_32F);
  const cv::Size twice(2 * half.px.width, 2 * half.px.height);
  cv::resize(cv_view(half.px).mul(weight), value, twice, 0, 0, cv::INTER_LINEAR);
  cv::resize(weight, share, twice, 0, 0, cv::INTER_LINEAR);
  cv::resize(cv_view(half.px), guess, twice, 0, 0, cv::INTER_LINEAR);
  constexpr float kMostly = 0.5F;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      // Of an odd size the last row or column is the one before.
      const int i = std::min(x, twice.width - 1), j = std::min(y, twice.height - 1);
      const float known = share.at<float>(j, i);
      full.known.at(x, y) = known >= kMostly;
      full.px.at(x, y) =
          2 * (known >= kMostly ? value.at<float>(j, i) / known : guess.at<float>(j, i));
    }
  return full;
}

}  // namespace organbake
