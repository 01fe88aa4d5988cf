// SPDX-License-Identifier: GPL-3.0-or-later
// Depth of a stereo pair. In: both eyes' prepared pictures. Out: depth of the left one with its
// confidence, and a verdict. On the way: matching, refinement, averaging as wide as the noise asks
// for, and gaps closed.
#include "organbake/stereo/stereo_depth.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "disparity.h"
#include "organbake/core/error.h"
#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/core/text.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/shading/depth_maps.h"
#include "organbake/shading/grid_filters.h"
#include "organbake/shading/masks.h"

namespace organbake {
namespace {

// Gaps are what a disc of their width, moved about in what is unknown, does not reach (the closing
// of what is known: Serra 1982), by two distance transforms. Each pixel's value is of the narrowest
// window that sees enough of the surroundings, so that it is the same however wide gaps may be.

// Pixels that no disc of that width fits over without touching a known one.
cv::Mat closed(const Mask& known, double width_px) {
  const double radius = 0.5 * width_px;
  // Nothing is known beyond the picture.
  const int margin = static_cast<int>(radius) + 2;
  cv::Mat unknown, distance;
  cv::copyMakeBorder(cv_view(known) == 0, unknown, margin, margin, margin, margin,
                     cv::BORDER_CONSTANT, 255);
  cv::distanceTransform(unknown, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  const cv::Mat near = distance <= radius;
  cv::distanceTransform(near, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  const cv::Mat result = distance > radius;
  return result(cv::Rect(margin, margin, known.width, known.height)).clone();
}

}  // namespace

Mask close_gaps(const Mask& tissue, double width_px, Disparity& disparity) {
  const int width = tissue.width, height = tissue.height;
  Mask filled(width, height);
  if (width_px < 1) return filled;
  const cv::Mat gaps = closed(disparity.known, width_px);
  Mask open(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      open.at(x, y) = gaps.at<std::uint8_t>(y, x) && tissue.at(x, y) && !disparity.known.at(x, y);
  constexpr float kEnough = 0.25F, kFlat = 0.02F;  // of the window; of the disparity
  Plane known(width, height);
  for (std::size_t k = 0; k < known.size(); ++k) known.values[k] = disparity.known.values[k];
  for (int radius = 4; radius < 2 * std::max(width, height); radius *= 2) {
    if (std::find(open.values.begin(), open.values.end(), 1) == open.values.end()) break;
    const LocalPlanes around(disparity.px, known, radius);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        if (!open.at(x, y) || around.weight(x, y) < kEnough) continue;
        open.at(x, y) = 0;
        const LocalPlanes::Fit fit = around.at(x, y);
        const float most = kFlat * fit.value;
        filled.at(x, y) = fit.variance <= most * most;
        if (filled.at(x, y)) disparity.px.at(x, y) = fit.value;
      }
  }
  return filled;
}

namespace {

constexpr int kCoarse_px = 640;  // the longest side at which whole pixels are matched
constexpr MatchWindow kRefine;

struct EyePyramids {
  std::vector<EyeImage> left, right;
};

EyePyramids pyramids(const PreparedFrame& left, const PreparedFrame& right) {
  EyePyramids both;
  parallel_both([&] { both.left = eye_pyramid(left.color, left.diffuse, kCoarse_px); },
                [&] { both.right = eye_pyramid(right.color, right.diffuse, kCoarse_px); });
  return both;
}

// From whole pixels of the coarsest level to fractions of the finest.
Disparity coarse_to_fine(const EyePyramids& eyes, const DisparityRange& coarse_range) {
  Disparity disparity = match_eyes(eyes.left.back(), eyes.right.back(), coarse_range);
  guess_unknown(Mask(disparity.px.width, disparity.px.height, 1), disparity);
  for (std::size_t level = eyes.left.size(); level-- > 0;) {
    const EyeImage &left = eyes.left[level], &right = eyes.right[level];
    if (level + 1 < eyes.left.size())
      disparity = doubled(disparity, left.pattern.width, left.pattern.height);
    refine_disparity(left, right, kRefine, disparity);
  }
  return disparity;
}

// Where the eyes agree that there is a surface in reach.
Mask agreed(const Disparity& disparity, const Agreement& agreement, const Mask& tissue,
            const DisparityRange& range, double at_infinity) {
  constexpr float kAlike = 0.5F, kAlikeGuess = 0.85F, kMostRelativeSd = 0.05F;
  Mask found(tissue.width, tissue.height);
  for (std::size_t k = 0; k < found.size(); ++k) {
    const float d = disparity.px.values[k];
    const float alike = disparity.known.values[k] ? kAlike : kAlikeGuess;
    found.values[k] = tissue.values[k] && agreement.correlation.values[k] >= alike &&
                      d >= range.least_px && d <= range.most_px &&
                      agreement.sd_px.values[k] <= kMostRelativeSd * (d - at_infinity);
  }
  return found;
}

double share_of(const Mask& part, const Mask& whole) {
  double inside = 0, all = 0;
  for (std::size_t k = 0; k < whole.size(); ++k) {
    all += whole.values[k] != 0;
    inside += whole.values[k] && part.values[k];
  }
  return all > 0 ? inside / all : 0;
}

EyeImage upside_down(const EyeImage& eye) {
  EyeImage turned = eye;
  cv::Mat pattern = cv_view(turned.pattern), diffuse = cv_view(turned.diffuse);
  cv::flip(cv_view(eye.pattern), pattern, 0);
  cv::flip(cv_view(eye.diffuse), diffuse, 0);
  return turned;
}

// How much of what one eye shows the other finds again, on one level alone.
double found_again(const EyeImage& left, const EyeImage& right, const DisparityRange& range,
                   double at_infinity) {
  Disparity disparity = match_eyes(left, right, range);
  refine_disparity(left, right, kRefine, disparity);
  const Agreement agreement = judge_disparity(left, right, kRefine, disparity);
  const Mask matched = disparity.known;
  disparity.known = agreed(disparity, agreement, left.diffuse, range, at_infinity);
  for (std::size_t k = 0; k < matched.size(); ++k) disparity.known.values[k] &= matched.values[k];
  drop_strangers(disparity);
  return share_of(disparity.known, left.diffuse);
}

// What a little that is found again is worth. As much as is found in the right picture upside down,
// where nothing of the left one is, is chance (a decoy; Elias & Gygi 2007). And where more is found
// at distances that were not asked for, the little within is a chance as well: both pictures of one
// eye, another calibration, tissue that lies nearer or farther.
void weigh_the_little(const EyeImage& left, const EyeImage& right, const DisparityRange& range,
                      double at_infinity, StereoDepth& result) {
  constexpr double kWider_px = 32;  // of the coarsest level
  const double found = found_again(left, right, range, at_infinity);
  result.chance_share =
      found > 0 ? std::min(1.0, found_again(left, upside_down(right), range, at_infinity) / found)
                : 1;
  const DisparityRange wide{range.least_px - kWider_px, range.most_px + kWider_px};
  const double anywhere = found_again(left, right, wide, at_infinity - kWider_px);
  result.elsewhere_share = anywhere > found ? 1 - found / anywhere : 0;
}

void set_depth(const Plane& disparity, const Mask& inside, const PreparedFrame& left,
               const RectifiedEyes& eyes, FrameDepth& result) {
  const RayGrid rays = ray_grid(left.camera);
  const double reach = eyes.camera.fx * eyes.baseline_mm;
  constexpr double kLeast_px = 0.1;
  Plane log_range(disparity.width, disparity.height);
  for (int y = 0; y < disparity.height; ++y)
    for (int x = 0; x < disparity.width; ++x) {
      const double d = std::max(kLeast_px, double(disparity.at(x, y)) - eyes.disparity_at_infinity);
      const double u = rays.x(x), v = rays.y(y);
      log_range.at(x, y) =
          static_cast<float>(std::log(reach / d) + 0.5 * std::log1p(u * u + v * v));
    }
  result.depth = depth_from_log_range(log_range, rays, inside);
  result.normals = normals_from_log_range(log_range, rays);
  result.metric = true;
}

void check_pictures(const PreparedFrame& left, const PreparedFrame& right,
                    const RectifiedEyes& eyes) {
  const auto size = [](int width, int height) {
    return std::to_string(width) + "x" + std::to_string(height);
  };
  const Rgb8Image &a = left.color, &b = right.color;
  if (a.width != b.width || a.height != b.height)
    throw BadDataError("the left picture is " + size(a.width, a.height) + ", the right one " +
                       size(b.width, b.height) + "; they must be of one size");
  if (a.width != eyes.camera.width || a.height != eyes.camera.height)
    throw BadDataError("the pictures are " + size(a.width, a.height) + ", their cameras " +
                       size(eyes.camera.width, eyes.camera.height));
}

// Where texture is stronger than the picture's noise, and than the steps of 8 bits. Beyond, in the
// dark rim that lenses leave, nothing can be matched, and nothing is missed.
Mask lit_enough(const PreparedFrame& frame) {
  constexpr float kLeastLevel = 20, kTimesNoise = 10;
  const Plane grey = grey_levels(frame.color);
  const float least =
      std::max(kLeastLevel, kTimesNoise * static_cast<float>(noise_level(grey, frame.field)));
  const Plane around = box_mean(grey, frame.field, 4);
  Mask lit = frame.field;
  for (std::size_t k = 0; k < lit.size(); ++k)
    lit.values[k] = lit.values[k] && around.values[k] >= least;
  return lit;
}

// Chosen by the study of organbench's suite `stereo`.
constexpr double kLeastCovered = 0.05, kMostlyCovered = 0.5, kLeastLit = 0.4;
constexpr double kSureByChance = 0.2, kMostByChance = 0.4;  // asked below kMostlyCovered
constexpr double kMostElsewhere = 0.5;
constexpr double kRowsApart_px = 1.0, kUnsure = 0.03;
// Of the width; finer is the matching's own error, coarser than the most its windows do not follow.
constexpr double kRowsUneven = 0.0009, kLeastUneven_px = 0.35, kMostUneven_px = 0.75;
constexpr double kLeastSeen = 0.02;  // of the frame

// Whether the eyes support the depth: what they find alike is more than chance, on the same rows,
// and sure enough. How much of the field of view that is says little of whether it is right: bare
// walls match nowhere.
DepthQuality judge_stereo(const StereoDepth& result, const PreparedFrame& left) {
  const double seen = share_of(left.diffuse, Mask(left.diffuse.width, left.diffuse.height, 1));
  const std::string covered =
      percent(result.covered_share, 1) +
      " of what is lit in the field of view is found again by the other eye";
  DepthQuality quality{DepthVerdict::ok, "", result.covered_share, 0};
  const auto judged = [&](DepthVerdict verdict, std::string reason) {
    quality.verdict = verdict;
    quality.reason = std::move(reason);
    return quality;
  };
  if (seen < kLeastSeen)
    return judged(DepthVerdict::failed,
                  "only " + percent(seen, 1) +
                      " of the frame is lit tissue that is neither highlight nor instrument");
  if (result.covered_share < kLeastCovered) return judged(DepthVerdict::failed, "only " + covered);
  const std::string chance = ", of which " + percent(result.chance_share) +
                             " would be found by chance, in a picture of something else";
  if (result.elsewhere_share > kMostElsewhere)
    return judged(DepthVerdict::failed,
                  "only " + covered +
                      " at the distances that were asked for, and more at others: " +
                      "are the pictures those of both eyes, of this calibration, and is the tissue "
                      "within --nearest-mm and --farthest-mm?");
  if (result.chance_share > kMostByChance)
    return judged(DepthVerdict::failed, "only " + covered + chance);
  if (std::abs(result.rows_apart_px) > kRowsApart_px)
    return judged(DepthVerdict::doubtful,
                  "the rows of the eyes are " + to_text(result.rows_apart_px, 1) +
                      " px apart: the calibration is not that of these pictures, or they were not "
                      "taken at the same time");
  if (result.rows_uneven_px >
      std::clamp(kRowsUneven * left.color.width, kLeastUneven_px, kMostUneven_px))
    return judged(DepthVerdict::doubtful,
                  "parts of the pictures lie " + to_text(result.rows_uneven_px, 1) +
                      " px above or below their rows, each otherwise: the calibration's lenses are "
                      "not those of these pictures, or the scene has moved between them");
  if (result.chance_share > kSureByChance)
    return judged(DepthVerdict::doubtful, "only " + covered + chance);
  if (result.lit_share < kLeastLit)
    return judged(DepthVerdict::doubtful, "only " + percent(result.lit_share, 1) +
                                              " of the field of view is lit enough to match");
  if (left.squares_px > 1 && result.step_share > kUnsure)
    return judged(DepthVerdict::doubtful,
                  "the pictures are made of squares of " + std::to_string(left.squares_px) +
                      " px, a mosaic or small pictures that were enlarged: depth is told in steps "
                      "of " +
                      percent(result.step_share, 1) +
                      " (median); give the pictures as they "
                      "were taken");
  if (result.relative_sd > kUnsure)
    return judged(DepthVerdict::doubtful,
                  "the depth is uncertain by " + percent(result.relative_sd, 1) + " (median)");
  return quality;
}

// How much of the field of view is covered, of what is lit or covered all the same.
void measure_coverage(const Mask& inside, const PreparedFrame& left, StereoDepth& result) {
  Mask counts = lit_enough(left);
  for (std::size_t k = 0; k < counts.size(); ++k)
    counts.values[k] = left.field.values[k] && (counts.values[k] || inside.values[k]);
  result.covered_share = share_of(inside, counts);
  result.lit_share = share_of(counts, left.field);
}

}  // namespace

void StereoOptions::check() const {
  if (!(nearest_mm > 0 && nearest_mm < farthest_mm))
    throw UsageError("tissue from " + to_text(nearest_mm) + " to " + to_text(farthest_mm) +
                     " mm away: the nearest must be less than the farthest");
}

DisparityRange disparity_range(const RectifiedEyes& eyes, const StereoOptions& options,
                               double scale) {
  const double at_one_mm = eyes.camera.fx * eyes.baseline_mm;
  return {(eyes.disparity_at_infinity + at_one_mm / options.farthest_mm) * scale,
          (eyes.disparity_at_infinity + at_one_mm / options.nearest_mm) * scale};
}

StereoDepth stereo_depth(const PreparedFrame& left, const PreparedFrame& right,
                         const RectifiedEyes& eyes, const StereoOptions& options) {
  options.check();
  check_pictures(left, right, eyes);
  const EyePyramids both = pyramids(left, right);
  const double scale = std::ldexp(1.0, 1 - static_cast<int>(both.left.size()));
  const DisparityRange range = disparity_range(eyes, options);
  Disparity disparity = coarse_to_fine(both, disparity_range(eyes, options, scale));
  const Agreement agreement =
      judge_disparity(both.left.front(), both.right.front(), kRefine, disparity);
  StereoDepth result;
  disparity.known = agreed(disparity, agreement, left.tissue, range, eyes.disparity_at_infinity);
  drop_strangers(disparity);
  result.matched_share = share_of(disparity.known, left.tissue);
  if (swapped(both.left.back(), both.right.back(), disparity_range(eyes, options, scale),
              result.matched_share))
    throw BadDataError(
        "the eyes look swapped: the left picture shows what the right eye sees; give them the "
        "other way round, or --swap-eyes");
  smooth_disparity(agreement.sd_px, disparity);
  const Mask filled = close_gaps(left.tissue, options.reach * left.tissue.width, disparity);
  result.filled_share = share_of(filled, left.tissue);
  result.rows_apart_px = agreement.rows_apart_px;
  result.rows_uneven_px = agreement.rows_uneven_px;
  Mask inside = disparity.known;
  for (std::size_t k = 0; k < inside.size(); ++k) inside.values[k] |= filled.values[k];
  set_depth(disparity.px, inside, left, eyes, result.depth);

  FrameDepth& depth = result.depth;
  depth.confidence = Plane(left.color.width, left.color.height);
  std::vector<float> relative, steps;
  constexpr float kUsual = 0.01F, kFilled = 0.25F;
  for (std::size_t k = 0; k < inside.size(); ++k) {
    if (!inside.values[k]) continue;
    const double d = disparity.px.values[k] - eyes.disparity_at_infinity;
    const float sd = static_cast<float>(agreement.sd_px.values[k] / d);
    if (disparity.known.values[k]) relative.push_back(sd);
    if (disparity.known.values[k]) steps.push_back(static_cast<float>(left.squares_px / d));
    const float alike = std::clamp(agreement.correlation.values[k], 0.F, 1.F);
    depth.confidence.values[k] =
        disparity.known.values[k] ? alike / (1 + sd * sd / (kUsual * kUsual)) : kFilled;
  }
  result.relative_sd = median(std::move(relative));
  if (left.squares_px > 1) result.step_share = median(std::move(steps));
  measure_coverage(inside, left, result);
  if (result.covered_share < kMostlyCovered)
    weigh_the_little(both.left.back(), both.right.back(), disparity_range(eyes, options, scale),
                     eyes.disparity_at_infinity * scale, result);
  depth.quality = judge_stereo(result, left);
  return result;
}

}  // namespace organbake
