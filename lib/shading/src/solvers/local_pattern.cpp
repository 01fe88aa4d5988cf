// SPDX-License-Identifier: GPL-3.0-or-later
// Brightness against its surroundings, in standard deviations of them: what stays the same when the
// lamp comes nearer or the gain changes, so that frames and eyes can be compared by it.
#include "organbake/shading/local_pattern.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "organbake/shading/cv_grid.h"

namespace organbake {
namespace {

constexpr int kSurroundings_px = 10;  // radius; texture of tissue is finer
constexpr float kNoise = 1.0F;        // levels: what is no stronger than noise stays weak

}  // namespace

Plane grey_levels(const Rgb8Image& color) {
  Plane grey(color.width, color.height);
  cv::Mat levels;
  cv::cvtColor(cv_view(color), levels, cv::COLOR_RGB2GRAY);
  levels.convertTo(cv_view(grey), CV_32F);
  return grey;
}

Plane local_pattern(const Plane& grey, const Mask& counts) {
  Plane pattern(grey.width, grey.height);
  const cv::Mat levels = cv_view(grey);
  cv::Mat weight, mean, square;
  cv_view(counts).convertTo(weight, CV_32F);
  const cv::Size window(2 * kSurroundings_px + 1, 2 * kSurroundings_px + 1);
  const auto sum_around = [&](const cv::Mat& values, cv::Mat& sums) {
    cv::boxFilter(values, sums, CV_32F, window, {-1, -1}, true, cv::BORDER_CONSTANT);
  };
  const cv::Mat counted = levels.mul(weight);
  sum_around(counted, mean);
  sum_around(counted.mul(levels), square);
  cv::Mat share;
  sum_around(weight, share);
  for (int y = 0; y < grey.height; ++y)
    for (int x = 0; x < grey.width; ++x) {
      if (!counts.at(x, y)) continue;
      const float n = share.at<float>(y, x), m = mean.at<float>(y, x) / n;
      const float variance = std::max(0.F, square.at<float>(y, x) / n - m * m);
      pattern.at(x, y) = (grey.at(x, y) - m) / std::sqrt(variance + kNoise * kNoise);
    }
  return pattern;
}

void halve_counted(Plane& grey, Mask& counts) {
  const int width = grey.width / 2, height = grey.height / 2;
  Plane half(width, height);
  Mask half_counts(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      float sum = 0, all = 0;
      int counted = 0;
      for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i) {
          const float value = grey.at(2 * x + i, 2 * y + j);
          const bool one = counts.at(2 * x + i, 2 * y + j) != 0;
          all += value;
          sum += one ? value : 0;
          counted += one;
        }
      half.at(x, y) = counted > 0 ? sum / static_cast<float>(counted) : all / 4;
      half_counts.at(x, y) = counted >= 3;
    }
  grey = std::move(half);
  counts = std::move(half_counts);
}

}  // namespace organbake
