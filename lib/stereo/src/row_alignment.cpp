// SPDX-License-Identifier: GPL-3.0-or-later
// How far apart the rows of two pictures are: corners (Shi & Tomasi 1994) of the left one are
// sought in the right one along their rows and some rows beside them by normalised correlation; a
// shift and a roll are fitted to how far up or down they lie, by the least median of squares
// (Rousseeuw 1984) over pairs of them, then by least squares over those that agree.
#include "row_alignment.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "organbake/core/median.h"
#include "organbake/shading/cv_grid.h"

namespace organbake {
namespace {

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

}  // namespace

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

Rgb8Image aligned(const Rgb8Image& right, const Intrinsics& right_camera,
                  const RowAlignment& alignment) {
  const double c = std::cos(alignment.roll_rad), s = std::sin(alignment.roll_rad);
  // Pixels' centres are whole here.
  const double cx = right_camera.cx - 0.5, cy = right_camera.cy - 0.5;
  const cv::Mat seen_from_aligned = (cv::Mat_<double>(2, 3) << c, -s, cx - c * cx + s * cy, s, c,
                                     cy - s * cx - c * cy + alignment.shift_px);
  Rgb8Image result(right.width, right.height);
  const cv::Mat from(right.height, right.width, CV_8UC3,
                     const_cast<std::uint8_t*>(right.pixels.data()));
  cv::Mat to(result.height, result.width, CV_8UC3, result.pixels.data());
  cv::warpAffine(from, to, seen_from_aligned, to.size(), cv::INTER_CUBIC | cv::WARP_INVERSE_MAP,
                 cv::BORDER_CONSTANT);
  return result;
}

}  // namespace organbake
