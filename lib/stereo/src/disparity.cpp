// SPDX-License-Identifier: GPL-3.0-or-later
// Disparities between two rectified eyes: semi-global matching (Hirschmüller 2008; OpenCV's) both
// ways over patterns that know no gain, from coarse to fine, then fractions of a pixel. What the
// two ways do not find alike is unknown: it is hidden from one eye, or shows nothing to tell it by.
#include "disparity.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/shading/grid_filters.h"

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
  return cv::countNonZero(cv_view(found.known)) /
         std::max(1.0, double(cv::countNonZero(cv_view(left.diffuse))));
}

}  // namespace

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

// Disparities to a fraction of a pixel by least squares along the row (Lucas & Kanade 1981), their
// standard deviation from what is left, and their mean over planes.

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
  return quantile(std::move(off), kMost);
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

namespace {

// By radius, twice as wide each: the energy of the detail between it and the next finer one that
// counts as noise, in variances of a disparity. Twice what the phantom's bed shows, since noise has
// patches of its own; it wanes only where the mean is wider than the windows that were matched.
constexpr double kNoiseOfDetail[] = {8, 1.3, 0.4, 0.1};

// What of a detail is more than noise, by its energy round each pixel (Wiener's filter): 1 where it
// is far stronger, as at edges; 0 where it is not.
Plane told_share(const Plane& detail, const Plane& sd_px, const Mask& known, double noise_share,
                 int radius) {
  Plane energy = detail, noise(detail.width, detail.height);
  for (std::size_t k = 0; k < energy.size(); ++k) {
    energy.values[k] *= detail.values[k];
    const float sd = known.values[k] ? std::max(kLeastSd_px, sd_px.values[k]) : 0;
    noise.values[k] = static_cast<float>(noise_share) * sd * sd;
  }
  energy = box_mean(energy, known, radius);
  noise = box_mean(noise, known, radius);
  for (std::size_t k = 0; k < energy.size(); ++k)
    energy.values[k] = std::max(0.F, 1 - noise.values[k] / std::max(1e-12F, energy.values[k]));
  return energy;
}

}  // namespace

// Means over planes, each pixel by its certainty, wider and wider; what one tells beyond the next
// is kept as far as it is more than noise, and of the finest, whose noise has long tails, only what
// leaves its plane as steps do.
void smooth_disparity(const Plane& sd_px, Disparity& disparity) {
  const Plane raw = disparity.px, weight = certainty(sd_px, disparity.known);
  const int width = raw.width, height = raw.height;
  Plane finer = raw, kept(width, height);
  int radius = kSmooth_px;
  for (const double noise_share : kNoiseOfDetail) {
    const LocalPlanes planes(raw, weight, radius);
    Plane smooth(width, height), detail(width, height);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        if (!disparity.known.at(x, y)) continue;
        const LocalPlanes::Fit fit = planes.at(x, y);
        smooth.at(x, y) = fit.value;
        detail.at(x, y) = finer.at(x, y) - fit.value;
        if (radius == kSmooth_px)
          kept.at(x, y) = fit.variance / (fit.variance + kSmoothTo_px * kSmoothTo_px);
      }
    const Plane told = told_share(detail, sd_px, disparity.known, noise_share, radius);
    for (std::size_t k = 0; k < kept.size(); ++k) {
      const float own = told.values[k] * detail.values[k];
      kept.values[k] = radius == kSmooth_px ? kept.values[k] * own : kept.values[k] + own;
    }
    finer = std::move(smooth);
    radius *= 2;
  }
  for (std::size_t k = 0; k < kept.size(); ++k)
    if (disparity.known.values[k]) disparity.px.values[k] = finer.values[k] + kept.values[k];
}

}  // namespace organbake
