// SPDX-License-Identifier: GPL-3.0-or-later
// Whether what the masks call instruments lies off the surface around: the plane through the
// disparities beside it is held against its own, from a coarse match of both eyes without masks of
// instruments. Steel that nothing can be matched on stays what it looks like.
#include "instruments_by_depth.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "organbake/core/median.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/shading/masks.h"
#include "organbake/stereo/local_planes.h"

namespace organbake {
namespace {

constexpr int kGlance_px = 320;

bool is_empty(const Mask& mask) {
  return std::all_of(mask.values.begin(), mask.values.end(), [](auto value) { return value == 0; });
}

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

}  // namespace

void keep_instruments_off_the_surface(const DisparityRange& range, PreparedFrame& left,
                                      PreparedFrame& right) {
  if (is_empty(left.instruments) && is_empty(right.instruments)) return;
  const EyeImage a =
      eye_pyramid(left.color, without(left.field, left.highlights), kGlance_px).back();
  const EyeImage b =
      eye_pyramid(right.color, without(right.field, right.highlights), kGlance_px).back();
  const double scale = double(a.pattern.width) / left.color.width;
  const Disparity found = match_eyes(a, b, {range.least_px * scale, range.most_px * scale});
  keep_what_is_off(a.pattern, found, left);
  keep_what_is_off(b.pattern, seen_by_right(found), right);
}

}  // namespace organbake
