// SPDX-License-Identifier: GPL-3.0-or-later
// Semi-global matching (Hirschmüller 2008; OpenCV's) both ways over patterns that know no gain,
// from coarse to fine. What the two ways do not find alike is unknown: it is hidden from one eye,
// or shows nothing to tell it by.
#include "disparity.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "organbake/core/parallel.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/shading/local_pattern.h"
#include "organbake/stereo/local_planes.h"

namespace organbake {
namespace {

constexpr int kSteps = 16;  // of OpenCV's disparities in a pixel

// Patterns of −3…3 deviations as OpenCV's matcher takes pictures.
cv::Mat eight_bits(const EyeImage& eye) {
  constexpr double kPerDeviation = 40, kMiddle = 128;
  cv::Mat levels;
  cv_view(eye.pattern).convertTo(levels, CV_8U, kPerDeviation, kMiddle);
  return levels;
}

// Disparities of the left picture's pixels, in OpenCV's steps.
cv::Mat semi_global(const cv::Mat& left, const cv::Mat& right, int least_px, int count_px) {
  constexpr int kBlock = 5, kSmooth = 8 * kBlock * kBlock, kJump = 40 * kBlock * kBlock;
  constexpr int kCap = 63, kUnique_percent = 3, kSpeckle_px = 60, kSpeckleRange_px = 2;
  // OpenCV leaves out the columns whose range leaves the picture; with a margin none is.
  const int margin = std::max(0, least_px + count_px);
  cv::Mat wide_left, wide_right, steps;
  const int beyond = std::max(0, -least_px);
  cv::copyMakeBorder(left, wide_left, 0, 0, margin, beyond, cv::BORDER_REPLICATE);
  cv::copyMakeBorder(right, wide_right, 0, 0, margin, beyond, cv::BORDER_REPLICATE);
  const auto matcher = cv::StereoSGBM::create(
      least_px, count_px, kBlock, kSmooth, kJump, /*disp12MaxDiff=*/-1, kCap, kUnique_percent,
      kSpeckle_px, kSpeckleRange_px, cv::StereoSGBM::MODE_SGBM_3WAY);
  matcher->compute(wide_left, wide_right, steps);
  return steps(cv::Rect(margin, 0, left.cols, left.rows)).clone();
}

cv::Mat mirrored_picture(const cv::Mat& picture) {
  cv::Mat other;
  cv::flip(picture, other, 1);
  return other;
}

double matched(const EyeImage& left, const EyeImage& right, const DisparityRange& range) {
  const Disparity found = match_eyes(left, right, range);
  const auto count = [](const Mask& mask) {
    return static_cast<double>(mask.size()) -
           static_cast<double>(std::count(mask.values.begin(), mask.values.end(), 0));
  };
  return count(found.known) / std::max(1.0, count(left.diffuse));
}

}  // namespace

DisparityRange disparity_range(const RectifiedEyes& eyes, const StereoOptions& options,
                               double scale) {
  const double at_one_mm = eyes.camera.fx * eyes.baseline_mm;
  return {(eyes.disparity_at_infinity + at_one_mm / options.farthest_mm) * scale,
          (eyes.disparity_at_infinity + at_one_mm / options.nearest_mm) * scale};
}

std::vector<EyeImage> eye_pyramid(const Rgb8Image& color, const Mask& counts, int longest_px) {
  Plane grey = grey_levels(color);
  Mask used = counts;
  std::vector<EyeImage> levels = {{local_pattern(grey, used), used}};
  while (std::max(grey.width, grey.height) > longest_px) {
    halve_counted(grey, used);
    levels.push_back({local_pattern(grey, used), used});
  }
  return levels;
}

Disparity match_eyes(const EyeImage& left, const EyeImage& right, const DisparityRange& range) {
  const int width = left.pattern.width, height = left.pattern.height;
  const int least = static_cast<int>(std::floor(range.least_px)) - 1;
  const int asked = static_cast<int>(std::ceil(range.most_px)) + 2 - least;
  const int count = std::clamp((asked + 15) / 16, 1, std::max(1, width / 16)) * 16;
  const cv::Mat a = eight_bits(left), b = eight_bits(right);
  cv::Mat of_left, of_right;
  parallel_both([&] { of_left = semi_global(a, b, least, count); },
                [&] {
                  of_right = mirrored_picture(
                      semi_global(mirrored_picture(b), mirrored_picture(a), least, count));
                });
  Disparity found{Plane(width, height), Mask(width, height)};
  const int lowest = least * kSteps;
  for (int y = 0; y < height; ++y) {
    const auto* one = of_left.ptr<std::int16_t>(y);
    const auto* other = of_right.ptr<std::int16_t>(y);
    for (int x = 0; x < width; ++x) {
      if (one[x] < lowest || !left.diffuse.at(x, y)) continue;
      const int at = x - static_cast<int>(std::lround(one[x] / double(kSteps)));
      if (at < 0 || at >= width || other[at] < lowest || !right.diffuse.at(at, y)) continue;
      if (std::abs(one[x] - other[at]) > kSteps) continue;
      found.px.at(x, y) = static_cast<float>(one[x]) / kSteps;
      found.known.at(x, y) = 1;
    }
  }
  return found;
}

bool swapped(const EyeImage& left, const EyeImage& right, const DisparityRange& range,
             double matched_share) {
  constexpr double kWell = 0.6, kLeast = 0.4, kTimesBetter = 1.5;
  if (matched_share >= kWell) return false;
  const double other_way = matched(right, left, range);
  return other_way > kLeast && other_way > kTimesBetter * matched(left, right, range);
}

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
