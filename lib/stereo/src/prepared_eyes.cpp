// SPDX-License-Identifier: GPL-3.0-or-later
// Both eyes' pictures ready to be matched: rectified, on the same rows, with masks of what is no
// tissue.
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "disparity.h"
#include "organbake/core/parallel.h"
#include "organbake/core/quantile.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/shading/grid_filters.h"
#include "organbake/shading/masks.h"
#include "organbake/shading/prepared_frame.h"
#include "organbake/stereo/stereo_depth.h"

namespace organbake {
namespace {

// How far apart the rows of two pictures are: corners (Shi & Tomasi 1994) of the left one are
// sought in the right one along their rows and some rows beside them by normalised correlation; a
// shift and a roll are fitted to how far up or down they lie, by the least median of squares
// (Rousseeuw 1984) over pairs of them, then by least squares over those that agree.

constexpr int kLongest_px = 640;
constexpr int kCorners = 300;
constexpr int kPatch_px = 10;         // to each side
constexpr double kRowsSought = 0.02;  // of the height, up and down
constexpr int kLeastAgreeing = 30;

// Of a corner: where the right eye sees it from the picture's middle, and how far below its row.
struct RowOffset {
  double x = 0, down = 0;
};

cv::Mat reduced_grey(const Rgb8Image& picture, cv::Size size) {
  const Plane grey = grey_levels(picture);
  cv::Mat small;
  cv::resize(cv_view(grey), small, size, 0, 0, cv::INTER_AREA);
  return small;
}

// The middle of the parabola through three values, from the middle one.
double peak_between(double before, double at, double after) {
  const double bend = before - 2 * at + after;
  return bend < 0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0;
}

// Where the patch round a corner lies in the right picture, or nothing where that is in doubt.
std::optional<RowOffset> offset_of(const cv::Mat& left, const cv::Mat& right, cv::Point corner,
                                   const DisparityRange& range) {
  constexpr double kAlike = 0.75, kNextBest = 0.92;
  constexpr int kAside = 3;  // px: nearer than this a second peak is the first one's slope
  const int rows = std::max(5, static_cast<int>(std::lround(kRowsSought * left.rows)));
  const cv::Rect patch(corner.x - kPatch_px, corner.y - kPatch_px, 2 * kPatch_px + 1,
                       2 * kPatch_px + 1);
  const int first = corner.x - static_cast<int>(std::ceil(range.most_px));
  const int last = corner.x - static_cast<int>(std::floor(range.least_px));
  const cv::Rect whole(0, 0, right.cols, right.rows);
  const cv::Rect sought = cv::Rect(first - kPatch_px, corner.y - rows - kPatch_px,
                                   last - first + 2 * kPatch_px + 1, 2 * (rows + kPatch_px) + 1) &
                          whole;
  if ((patch & whole) != patch || sought.width <= patch.width || sought.height <= patch.height)
    return std::nullopt;
  cv::Mat alike;
  cv::matchTemplate(right(sought), left(patch), alike, cv::TM_CCOEFF_NORMED);
  double best = 0, next = 0;
  cv::Point at;
  cv::minMaxLoc(alike, nullptr, &best, nullptr, &at);
  if (!(best >= kAlike) || at.y == 0 || at.y == alike.rows - 1) return std::nullopt;
  cv::Mat others = alike.clone();
  cv::rectangle(others, cv::Point(at.x - kAside, at.y - kAside),
                cv::Point(at.x + kAside, at.y + kAside), cv::Scalar(-1), cv::FILLED);
  cv::minMaxLoc(others, nullptr, &next);
  if (next > kNextBest * best) return std::nullopt;
  const double between =
      peak_between(alike.at<float>(at.y - 1, at.x), best, alike.at<float>(at.y + 1, at.x));
  return RowOffset{double(sought.x + at.x + kPatch_px),
                   sought.y + at.y + kPatch_px + between - corner.y};
}

// down = at_middle + slope · x.
struct RowLine {
  double at_middle = 0, slope = 0;
  double off(const RowOffset& o) const { return o.down - at_middle - slope * o.x; }
};

RowLine line_of_least_median(const std::vector<RowOffset>& offsets) {
  constexpr std::size_t kTries = 400;
  RowLine best;
  double least = INFINITY;
  const std::size_t n = offsets.size();
  for (std::size_t k = 0; k < kTries; ++k) {
    const RowOffset &a = offsets[k * 7 % n], &b = offsets[(k * 31 + n / 2) % n];
    if (std::abs(a.x - b.x) < 20) continue;
    RowLine line;
    line.slope = (b.down - a.down) / (b.x - a.x);
    line.at_middle = a.down - line.slope * a.x;
    std::vector<float> off;
    for (const RowOffset& o : offsets) off.push_back(static_cast<float>(std::abs(line.off(o))));
    const double middle = median(std::move(off));
    if (middle < least) least = middle, best = line;
  }
  return best;
}

// Least squares, with the standard deviations of both.
struct FittedLine {
  RowLine line;
  double sd_at_middle = INFINITY, sd_slope = INFINITY;
};

FittedLine fit(const std::vector<RowOffset>& offsets) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, squares = 0;
  for (const RowOffset& o : offsets)
    n += 1, sx += o.x, sy += o.down, sxx += o.x * o.x, sxy += o.x * o.down;
  const double determinant = n * sxx - sx * sx;
  if (n < 3 || !(determinant > 0)) return {};
  FittedLine found;
  found.line = {(sxx * sy - sx * sxy) / determinant, (n * sxy - sx * sy) / determinant};
  for (const RowOffset& o : offsets) squares += std::pow(found.line.off(o), 2);
  const double variance = squares / (n - 2);
  found.sd_at_middle = std::sqrt(variance * sxx / determinant);
  found.sd_slope = std::sqrt(variance * n / determinant);
  return found;
}

std::vector<RowOffset> row_offsets(const cv::Mat& left, const cv::Mat& right,
                                   const DisparityRange& range, double middle_x) {
  constexpr double kLeastQuality = 0.01, kApart_px = 10;
  cv::Mat lit;
  cv::compare(left, 24, lit, cv::CMP_GT);
  cv::erode(lit, lit, cv::Mat(), {-1, -1}, kPatch_px);
  std::vector<cv::Point2f> corners;
  cv::goodFeaturesToTrack(left, corners, kCorners, kLeastQuality, kApart_px, lit);
  std::vector<RowOffset> offsets;
  for (const cv::Point2f& corner : corners)
    if (const auto offset = offset_of(left, right, corner, range))
      offsets.push_back({offset->x - middle_x, offset->down});
  return offsets;
}

// Finds how far the rows of two rectified pictures are apart; zero where that is no more than
// chance, or too little of the pictures tells it. `range`: of the disparities to look at.
RowAlignment find_row_alignment(const Rgb8Image& left, const Rgb8Image& right,
                                const Intrinsics& right_camera, const DisparityRange& range) {
  constexpr double kLeast_px = 0.4, kBeyondChance = 5;  // of the reduced picture; deviations
  const double scale = std::min(1.0, double(kLongest_px) / std::max(left.width, left.height));
  const cv::Size size(static_cast<int>(left.width * scale), static_cast<int>(left.height * scale));
  if (size.width < 64 || size.height < 64 || left.width != right.width ||
      left.height != right.height)
    return {};
  const std::vector<RowOffset> offsets =
      row_offsets(reduced_grey(left, size), reduced_grey(right, size),
                  {range.least_px * scale, range.most_px * scale}, right_camera.cx * scale);
  if (offsets.size() < kLeastAgreeing) return {};
  const RowLine rough = line_of_least_median(offsets);
  std::vector<RowOffset> agreeing;
  for (const RowOffset& o : offsets)
    if (std::abs(rough.off(o)) < 1) agreeing.push_back(o);
  if (agreeing.size() < kLeastAgreeing || 2 * agreeing.size() < offsets.size()) return {};
  const FittedLine found = fit(agreeing);
  const double at_side = std::abs(found.line.slope) * 0.5 * size.width;
  RowAlignment alignment;
  if (at_side > kLeast_px && std::abs(found.line.slope) > kBeyondChance * found.sd_slope)
    alignment.roll_rad = std::atan(found.line.slope);
  if ((std::abs(found.line.at_middle) > kLeast_px || alignment.roll_rad != 0) &&
      std::abs(found.line.at_middle) > kBeyondChance * found.sd_at_middle)
    alignment.shift_px = found.line.at_middle / scale;
  return alignment;
}

// The right picture with that taken out.
Rgb8Image aligned(const Rgb8Image& right, const Intrinsics& right_camera,
                  const RowAlignment& alignment) {
  const double c = std::cos(alignment.roll_rad), s = std::sin(alignment.roll_rad);
  // Pixels' centres are whole here.
  const double cx = right_camera.cx - 0.5, cy = right_camera.cy - 0.5;
  const cv::Mat seen_from_aligned = (cv::Mat_<double>(2, 3) << c, -s, cx - c * cx + s * cy, s, c,
                                     cy - s * cx - c * cy + alignment.shift_px);
  Rgb8Image result(right.width, right.height);
  cv::Mat to = cv_view(result);
  cv::warpAffine(cv_view(right), to, seen_from_aligned, to.size(),
                 cv::INTER_CUBIC | cv::WARP_INVERSE_MAP, cv::BORDER_CONSTANT);
  return result;
}

// Whether what the masks call instruments lies off the surface around: the plane through the
// disparities beside it is held against its own, from a coarse match of both eyes without masks of
// instruments. Steel that nothing can be matched on stays what it looks like.

constexpr int kGlance_px = 320;

// The left eye's disparities as the right eye sees them.
Disparity seen_by_right(const Disparity& left) {
  Disparity right{Plane(left.px.width, left.px.height), Mask(left.px.width, left.px.height)};
  for (int y = 0; y < left.px.height; ++y)
    for (int x = 0; x < left.px.width; ++x) {
      if (!left.known.at(x, y)) continue;
      const int at = x - static_cast<int>(std::lround(left.px.at(x, y)));
      if (at < 0 || at >= left.px.width) continue;
      right.known.at(at, y) = 1;
      right.px.at(at, y) = std::max(right.px.at(at, y), left.px.at(x, y));
    }
  return right;
}

// How much the pattern changes along the rows, which is what disparities are told by.
double change_along_rows(const Plane& pattern, const Mask& where) {
  double sum = 0, count = 0;
  for (int y = 0; y < pattern.height; ++y)
    for (int x = 1; x + 1 < pattern.width; ++x) {
      if (!where.at(x, y)) continue;
      sum += std::pow(double(pattern.at(x + 1, y)) - pattern.at(x - 1, y), 2);
      ++count;
    }
  return sum / std::max(1.0, count);
}

// Whether a region of the coarse picture lies on the surface around it, as far as that is seen: a
// shaft along the rows shows nothing to match, and takes on its surroundings' disparities.
bool on_the_surface(const Mask& region, const Plane& pattern, const Disparity& disparity) {
  constexpr double kAsUneven = 0.5;  // of the change beside it
  constexpr int kAround_px = 8;
  constexpr double kLeastKnown = 0.25, kOff_px = 0.5, kOffShare = 0.02;
  const int width = region.width, height = region.height;
  const Mask own = eroded(region, 1), near = dilated(region, 2);
  const Mask beside = without(dilated(region, 2 + kAround_px), near);
  if (change_along_rows(pattern, own) < kAsUneven * change_along_rows(pattern, beside))
    return false;
  Plane weight(width, height);
  double inside = 0, known = 0;
  for (std::size_t k = 0; k < weight.size(); ++k) {
    weight.values[k] = beside.values[k] && disparity.known.values[k];
    inside += own.values[k];
    known += own.values[k] && disparity.known.values[k];
  }
  if (known < kLeastKnown * inside || known < 10) return false;
  const LocalPlanes around(disparity.px, weight, kAround_px + 6);
  std::vector<float> off, own_px;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (!own.at(x, y) || !disparity.known.at(x, y) || around.weight(x, y) <= 0.05F) continue;
      off.push_back(disparity.px.at(x, y) - around.at(x, y).value);
      own_px.push_back(disparity.px.at(x, y));
    }
  if (off.size() < 10) return false;
  return std::abs(median(std::move(off))) < kOff_px + kOffShare * median(std::move(own_px));
}

void keep_what_is_off(const Plane& pattern, const Disparity& disparity, PreparedFrame& frame) {
  Grid<std::int32_t> labels(frame.instruments.width, frame.instruments.height);
  cv::Mat numbered(labels.height, labels.width, CV_32S, labels.values.data());
  const int count = cv::connectedComponents(cv_view(frame.instruments), numbered, 8, CV_32S);
  const double step = double(frame.instruments.width) / disparity.px.width;
  for (int label = 1; label < count; ++label) {
    Mask region(disparity.px.width, disparity.px.height);
    for (int y = 0; y < region.height; ++y)
      for (int x = 0; x < region.width; ++x)
        region.at(x, y) =
            labels.at(std::min(labels.width - 1, static_cast<int>((x + 0.5) * step)),
                      std::min(labels.height - 1, static_cast<int>((y + 0.5) * step))) == label;
    if (!on_the_surface(region, pattern, disparity)) continue;
    for (std::size_t k = 0; k < labels.size(); ++k)
      if (labels.values[k] == label) frame.instruments.values[k] = 0;
  }
  frame.tissue = without(frame.field, frame.instruments);
  frame.diffuse = without(frame.tissue, frame.highlights);
}

// Leaves as instruments what both frames' masks name and what does not lie on the surface around
// it: tissue that looks like a shaft has the depth of its surroundings, a shaft does not.
void keep_instruments_off_the_surface(const DisparityRange& range, PreparedFrame& left,
                                      PreparedFrame& right) {
  if (cv::countNonZero(cv_view(left.instruments)) + cv::countNonZero(cv_view(right.instruments)) ==
      0)
    return;
  const EyeImage a =
      eye_pyramid(left.color, without(left.field, left.highlights), kGlance_px).back();
  const EyeImage b =
      eye_pyramid(right.color, without(right.field, right.highlights), kGlance_px).back();
  const double scale = double(a.pattern.width) / left.color.width;
  const Disparity found = match_eyes(a, b, {range.least_px * scale, range.most_px * scale});
  keep_what_is_off(a.pattern, found, left);
  keep_what_is_off(b.pattern, seen_by_right(found), right);
}

// A mask as a picture, to go the way that pictures go; and back, with all that it has touched.
Rgb8Image as_picture(const Mask& mask) {
  Rgb8Image picture(mask.width, mask.height);
  for (std::size_t k = 0; k < mask.size(); ++k)
    if (mask.values[k]) std::fill_n(&picture.pixels[3 * k], 3, std::uint8_t{255});
  return picture;
}
Mask as_mask(const Rgb8Image& picture) {
  Mask mask(picture.width, picture.height);
  for (std::size_t k = 0; k < mask.size(); ++k) mask.values[k] = picture.pixels[3 * k] > 0;
  return mask;
}

}  // namespace

PreparedEyes prepare_eyes(StoredPicture left, StoredPicture right, const Rectifier& rectifier,
                          const StereoOptions& options, bool masks, const EyeInsets& insets) {
  const RectifiedEyes& eyes = rectifier.eyes();
  const DisparityRange range = disparity_range(eyes, options);
  const Intrinsics right_camera = eyes.right().intrinsics;
  const int squares = std::max(squares_px(left.color), squares_px(right.color));
  StoredPicture a, b;
  parallel_both([&] { a = rectifier.left(std::move(left)); },
                [&] { b = rectifier.right(std::move(right)); });
  PreparedEyes ready;
  ready.corrected = find_row_alignment(a.color, b.color, right_camera, range);
  if (ready.corrected.needed()) b = StoredPicture(aligned(b.color, right_camera, ready.corrected));
  Mask over_a, over_b;
  if (insets.left.size() > 0) over_a = as_mask(rectifier.left(as_picture(insets.left)).color);
  if (insets.right.size() > 0) {
    Rgb8Image over = rectifier.right(as_picture(insets.right)).color;
    if (ready.corrected.needed()) over = aligned(over, right_camera, ready.corrected);
    over_b = as_mask(over);
  }
  const auto known = [](const Mask& over) {
    return GivenMasks{.insets = over.size() > 0 ? &over : nullptr};
  };
  const FrameOptions prepare{.halvings = 0, .masks = masks, .piecewise_albedo = false};
  parallel_both([&] { ready.left = prepare_frame(a, eyes.camera, prepare, known(over_a)); },
                [&] { ready.right = prepare_frame(b, right_camera, prepare, known(over_b)); });
  ready.left.squares_px = ready.right.squares_px = squares;
  keep_instruments_off_the_surface(range, ready.left, ready.right);
  return ready;
}

}  // namespace organbake
