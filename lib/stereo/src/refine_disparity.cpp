// SPDX-License-Identifier: GPL-3.0-or-later
// Disparities to a fraction of a pixel by least squares along the row (Lucas & Kanade 1981), their
// standard deviation from what is left, and their mean over planes.
#include "refine_disparity.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "organbake/core/median.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/stereo/local_planes.h"
#include "tent_mean.h"

namespace organbake {
namespace {

constexpr float kLeastCounting = 0.25F;  // of a window
constexpr float kLeastJudged = 0.5F;     // the same, to tell whether the eyes agree
constexpr float kDamping = 1e-3F;        // deviations² per px²
constexpr float kLargestStep_px = 1;
constexpr float kFarthest_px = 1.5F;  // from where whole pixels, or the coarser level, put it

cv::Mat as_float(const Mask& mask) {
  cv::Mat weight;
  cv_view(mask).convertTo(weight, CV_32F);
  return weight;
}

enum class Along { rows, columns };

cv::Mat slopes(const cv::Mat& picture, Along along) {
  cv::Mat slope;
  const cv::Mat kernel = (cv::Mat_<float>(1, 5) << 1, -8, 0, 8, -1) / 12.F;
  cv::filter2D(picture, slope, CV_32F, along == Along::rows ? kernel : cv::Mat(kernel.t()),
               {-1, -1}, 0, cv::BORDER_REPLICATE);
  return slope;
}

// The right eye's picture laid on the left one's by the disparities.
struct Laid {
  cv::Mat pattern, weight;  // weight: 1 where both eyes count, else 0
};

Laid laid_on_left(const EyeImage& left, const EyeImage& right, const Plane& disparity) {
  const int width = disparity.width, height = disparity.height;
  cv::Mat columns(height, width, CV_32F), rows(height, width, CV_32F);
  for (int y = 0; y < height; ++y) {
    auto* column = columns.ptr<float>(y);
    std::fill_n(rows.ptr<float>(y), width, static_cast<float>(y));
    const float* d = &disparity.values[disparity.index(0, y)];
    for (int x = 0; x < width; ++x) column[x] = static_cast<float>(x) - d[x];
  }
  Laid laid;
  cv::Mat counts;
  cv::remap(cv_view(right.pattern), laid.pattern, columns, rows, cv::INTER_CUBIC,
            cv::BORDER_CONSTANT);
  cv::remap(as_float(right.diffuse), counts, columns, rows, cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  constexpr double kWhole = 0.99;
  cv::threshold(counts, counts, kWhole, 1, cv::THRESH_BINARY);
  laid.weight = counts.mul(as_float(left.diffuse));
  return laid;
}

cv::Mat common_slopes(const cv::Mat& a, const cv::Mat& b, Along along) {
  return slopes(0.5 * (a + b), along);
}

// How far up or down the windows of a part of the picture would have to move; nothing where too few
// of them tell it.
std::vector<float> rows_apart(const cv::Mat& pull, const cv::Mat& stiffness, const cv::Mat& share,
                              const cv::Rect& part) {
  std::vector<float> shifts;
  constexpr int kEvery = 4;
  constexpr float kStiff = 0.02F;
  for (int y = part.y; y < part.y + part.height; y += kEvery)
    for (int x = part.x; x < part.x + part.width; x += kEvery)
      if (share.at<float>(y, x) > kLeastCounting && stiffness.at<float>(y, x) > kStiff)
        shifts.push_back(pull.at<float>(y, x) / stiffness.at<float>(y, x));
  return shifts;
}

double rows_uneven(const cv::Mat& pull, const cv::Mat& stiffness, const cv::Mat& share) {
  constexpr int kParts = 8;
  constexpr std::size_t kEnough = 25;
  constexpr double kMost = 0.8;  // of the parts
  std::vector<double> off;
  const int width = pull.cols / kParts, height = pull.rows / kParts;
  for (int j = 0; j < kParts; ++j)
    for (int i = 0; i < kParts; ++i) {
      std::vector<float> shifts =
          rows_apart(pull, stiffness, share, {i * width, j * height, width, height});
      if (shifts.size() >= kEnough) off.push_back(std::abs(median(std::move(shifts))));
    }
  if (off.empty()) return 0;
  const auto at = off.begin() + static_cast<std::ptrdiff_t>(kMost * double(off.size() - 1));
  std::nth_element(off.begin(), at, off.end());
  return *at;
}

constexpr float kLeastSd_px = 0.03F;  // what is finer is not noise but the model
constexpr int kSmooth_px = 4;         // radius
constexpr float kSmoothTo_px = 0.6F;  // a surface that leaves its plane by more is not smoothed

Plane certainty(const Plane& sd_px, const Mask& known) {
  Plane weight(known.width, known.height);
  for (std::size_t k = 0; k < weight.size(); ++k) {
    const float sd = std::max(kLeastSd_px, sd_px.values[k]);
    weight.values[k] = known.values[k] ? kLeastSd_px * kLeastSd_px / (sd * sd) : 0;
  }
  return weight;
}

}  // namespace

void refine_disparity(const EyeImage& left, const EyeImage& right, const MatchWindow& options,
                      Disparity& disparity) {
  const cv::Mat pattern = cv_view(left.pattern);
  const Plane start = disparity.px;
  for (int i = 0; i < options.iterations; ++i) {
    const Laid laid = laid_on_left(left, right, disparity.px);
    const cv::Mat slope = common_slopes(pattern, laid.pattern, Along::rows);
    const cv::Mat difference = pattern - laid.pattern, weighted = laid.weight.mul(slope);
    const cv::Mat pull = tent_mean(weighted.mul(difference), options.radius_px);
    const cv::Mat stiffness = tent_mean(weighted.mul(slope), options.radius_px);
    const cv::Mat share = tent_mean(laid.weight, options.radius_px);
    for (int y = 0; y < disparity.px.height; ++y)
      for (int x = 0; x < disparity.px.width; ++x) {
        if (share.at<float>(y, x) < kLeastCounting) continue;
        const float step = -pull.at<float>(y, x) / (stiffness.at<float>(y, x) + kDamping);
        float& px = disparity.px.at(x, y);
        px = std::clamp(px + std::clamp(step, -kLargestStep_px, kLargestStep_px),
                        start.at(x, y) - kFarthest_px, start.at(x, y) + kFarthest_px);
      }
  }
}

Agreement judge_disparity(const EyeImage& left, const EyeImage& right, const MatchWindow& options,
                          const Disparity& disparity) {
  const int width = disparity.px.width, height = disparity.px.height, radius = options.radius_px;
  const cv::Mat pattern = cv_view(left.pattern);
  const Laid laid = laid_on_left(left, right, disparity.px);
  const cv::Mat a = laid.weight.mul(pattern), b = laid.weight.mul(laid.pattern);
  const cv::Mat difference = pattern - laid.pattern, w_difference = laid.weight.mul(difference);
  const cv::Mat across = common_slopes(pattern, laid.pattern, Along::rows);
  const cv::Mat down = common_slopes(pattern, laid.pattern, Along::columns);
  const cv::Mat share = tent_mean(laid.weight, radius), ab = tent_mean(a.mul(laid.pattern), radius);
  const cv::Mat aa = tent_mean(a.mul(pattern), radius), bb = tent_mean(b.mul(laid.pattern), radius);
  const cv::Mat left_over = tent_mean(w_difference.mul(difference), radius);
  const cv::Mat stiffness = tent_mean(laid.weight.mul(across).mul(across), radius);
  Agreement agreement{Plane(width, height), Plane(width, height, INFINITY), 0};
  // Pixels that a tent of that radius averages: (Σw)² / Σw² of a box folded with itself.
  const double side = 1.5 * (2 * radius + 1), pixels = side * side;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float n = share.at<float>(y, x);
      // What an eye does not see itself is not measured, however well its surroundings are.
      if (n < kLeastJudged || laid.weight.at<float>(y, x) == 0) continue;
      const double energy = double(aa.at<float>(y, x)) * bb.at<float>(y, x);
      agreement.correlation.at(x, y) =
          energy > 0 ? static_cast<float>(ab.at<float>(y, x) / std::sqrt(energy)) : 0;
      const double variance = left_over.at<float>(y, x) / n;
      agreement.sd_px.at(x, y) = static_cast<float>(
          std::sqrt(variance / (pixels * (stiffness.at<float>(y, x) + kDamping))));
    }
  const cv::Mat pull = tent_mean(w_difference.mul(down), radius);
  const cv::Mat stiff_down = tent_mean(laid.weight.mul(down).mul(down), radius);
  std::vector<float> shifts = rows_apart(pull, stiff_down, share, {0, 0, width, height});
  if (!shifts.empty()) agreement.rows_apart_px = median(std::move(shifts));
  agreement.rows_uneven_px = rows_uneven(pull, stiff_down, share);
  return agreement;
}

void drop_strangers(Disparity& disparity) {
  constexpr int kRounds = 2;  // strangers bend the planes that they are told by
  constexpr float kFar_px = 1.0F, kFarShare = 0.03F, kSurrounded = 0.3F;
  const int width = disparity.px.width, height = disparity.px.height;
  const int radius = std::max(4, width / 80);
  for (int round = 0; round < kRounds; ++round) {
    Plane known(width, height);
    for (std::size_t k = 0; k < known.size(); ++k) known.values[k] = disparity.known.values[k];
    const LocalPlanes around(disparity.px, known, radius);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        if (!disparity.known.at(x, y)) continue;
        const float px = disparity.px.at(x, y), off = std::abs(px - around.at(x, y).value);
        if (around.weight(x, y) < kSurrounded || off > kFar_px + kFarShare * std::abs(px))
          disparity.known.at(x, y) = 0;
      }
  }
}

void smooth_disparity(const Plane& sd_px, Disparity& disparity) {
  const LocalPlanes planes(disparity.px, certainty(sd_px, disparity.known), kSmooth_px);
  for (int y = 0; y < disparity.px.height; ++y)
    for (int x = 0; x < disparity.px.width; ++x) {
      if (!disparity.known.at(x, y)) continue;
      const LocalPlanes::Fit fit = planes.at(x, y);
      const float keep = fit.variance / (fit.variance + kSmoothTo_px * kSmoothTo_px);
      float& px = disparity.px.at(x, y);
      px = fit.value + keep * (px - fit.value);
    }
}

}  // namespace organbake
