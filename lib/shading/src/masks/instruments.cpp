// SPDX-License-Identifier: GPL-3.0-or-later
// Instruments by what they are: shafts that come in from the rim of the field of view (see
// shaft_search). Colours are taken against the picture's own usual tissue, so that pale, smoky and
// dark pictures look alike here.
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "masks/searches.h"
#include "organbake/core/quantile.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/shading/masks.h"

namespace organbake {
namespace {

// A shaft's outline. Each border is the path beside its straight line across which the hue rises
// most in all, found by dynamic programming (Amini, Weymouth & Jain 1990): tips taper, and a line
// through both the shaft and its tip fits neither.

constexpr double kStep = 0.5;            // px between the offsets that are tried
constexpr double kFurthest_px = 12;      // from the straight border
constexpr double kFurthestShare = 0.42;  // the same, of the width: the borders do not meet
constexpr int kMostSteps = 2;            // from one place along the border to the next
constexpr double kBend = 0.03;           // that a step to the side costs, in hue
constexpr double kPull = 5e-4;           // px⁻²: that distance from the straight line costs

// Of the hue between two offsets.
StripMean mean_across(const ShaftView& view, const Shaft& shaft, double t, double from, double to) {
  StripMean mean;
  for (double o = std::min(from, to); o <= std::max(from, to); ++o)
    mean.add(view, view.hue, shaft.at(t, o));
  return mean;
}

// How much the hue rises outward across a border there.
double rise(const ShaftView& view, const Shaft& shaft, int side, double t, double offset) {
  const double outward = side == 0 ? -1 : 1;
  StripMean outside, inside;
  for (int row = -1; row <= 1; ++row)
    for (const double k : {1.0, 2.0}) {
      outside.add(view, view.hue, shaft.at(t + row, offset + outward * k));
      inside.add(view, view.hue, shaft.at(t + row, offset - outward * k));
    }
  if (outside.known < 3 || inside.known < 3) return 0;
  return std::clamp(outside.mean() - inside.mean(), -0.5, 1.0);
}

// One border: its offset at each whole step from the shaft's begin to its end.
class BorderPath {
 public:
  BorderPath(const ShaftView& view, const Shaft& shaft, int side)
      : view_(view),
        shaft_(shaft),
        side_(side),
        places_(1 + static_cast<int>(shaft.to - shaft.from)),
        reach_(static_cast<int>(
            std::min(kFurthest_px, kFurthestShare * shaft.width(0.5 * (shaft.from + shaft.to))) /
            kStep)) {}

  std::vector<double> traced() const {
    const int count = 2 * reach_ + 1;
    std::vector<double> total = gains(0);
    std::vector<std::vector<int>> came_from;
    for (int place = 1; place < places_; ++place) {
      std::vector<double> next = gains(place);
      std::vector<int> from(static_cast<std::size_t>(count));
      for (int k = 0; k < count; ++k) {
        from[k] = k;
        for (int other = std::max(0, k - kMostSteps); other <= std::min(count - 1, k + kMostSteps);
             ++other)
          if (arrived(total, other, k) > arrived(total, from[k], k)) from[k] = other;
        next[k] += arrived(total, from[k], k);
      }
      total = std::move(next);
      came_from.push_back(std::move(from));
    }
    std::vector<double> path(static_cast<std::size_t>(places_));
    int k = static_cast<int>(std::max_element(total.begin(), total.end()) - total.begin());
    for (int place = places_ - 1; place >= 0; --place) {
      path[place] = offset(place, k);
      if (place > 0) k = came_from[place - 1][k];
    }
    return path;
  }

 private:
  const ShaftView& view_;
  const Shaft& shaft_;
  int side_, places_, reach_;

  double offset(int place, int k) const {
    return shaft_.edge(side_, shaft_.from + place) + kStep * (k - reach_);
  }
  std::vector<double> gains(int place) const {
    std::vector<double> all(static_cast<std::size_t>(2 * reach_ + 1));
    for (int k = 0; k <= 2 * reach_; ++k)
      all[k] = rise(view_, shaft_, side_, shaft_.from + place, offset(place, k)) -
               kPull * std::pow(kStep * (k - reach_), 2);
    return all;
  }
  static double arrived(const std::vector<double>& total, int from, int to) {
    return total[from] - kBend * std::abs(from - to);
  }
};

// The first and last place that is nearer to the shaft's own hue than to that beside it: followed
// by one border alone, a shaft is found longer than it is.
std::array<int, 2> ends_of(const ShaftView& view, const Shaft& shaft,
                           const std::array<std::vector<double>, 2>& border) {
  constexpr double kBeside_px = 5;
  std::vector<float> own, beside;
  std::vector<StripMean> inside;
  const int places = static_cast<int>(border[0].size());
  for (int i = 0; i < places; ++i) {
    const double t = shaft.from + i;
    inside.push_back(mean_across(view, shaft, t, border[0][i] + 1, border[1][i] - 1));
    for (int side = 0; side < 2; ++side) {
      const double outward = side == 0 ? -1 : 1;
      const StripMean there = mean_across(view, shaft, t, border[side][i] + outward,
                                          border[side][i] + outward * kBeside_px);
      if (there.known > 0) beside.push_back(static_cast<float>(there.mean()));
    }
    if (inside.back().known > 0) own.push_back(static_cast<float>(inside.back().mean()));
  }
  const double between = 0.5 * (median(std::move(own)) + median(std::move(beside)));
  const auto is_other = [&](int i) { return inside[i].known > 0 && inside[i].mean() > between; };
  std::array<int, 2> ends = {0, places - 1};
  while (ends[0] < ends[1] && is_other(ends[0])) ++ends[0];
  while (ends[0] < ends[1] && is_other(ends[1])) --ends[1];
  return ends;
}

// The outline of a shaft as the hue shows it, a polygon in pixels of the reduced picture: both
// borders may leave their straight lines, as they do beside a tapered tip. Empty where nothing is
// left of the shaft.
std::vector<cv::Point2d> trace_outline(const ShaftView& view, const Shaft& shaft) {
  constexpr double kBlur = 0.25;  // px
  std::array<std::vector<double>, 2> border;
  for (int side = 0; side < 2; ++side) border[side] = BorderPath(view, shaft, side).traced();
  const auto [first, last] = ends_of(view, shaft, border);
  if (first >= last) return {};
  std::vector<cv::Point2d> outline;
  for (int i = first; i <= last; ++i)
    outline.push_back(shaft.at(shaft.from + i, border[0][i] - kBlur));
  for (int i = last; i >= first; --i)
    outline.push_back(shaft.at(shaft.from + i, border[1][i] + kBlur));
  return outline;
}

constexpr int kLongest_px = 480;     // shafts are large: so many pixels show them as well
constexpr float kLeastSum = 60;      // of the three channels, to tell a hue from
constexpr double kLeastHue = 0.012;  // of the usual tissue; less is grey

// How much red leads green and blue, as shares of the sum of the three.
struct TissueHue {
  double over_green = 0, over_blue = 0;
  double square() const { return over_green * over_green + over_blue * over_blue; }
};

TissueHue usual_hue(const cv::Mat& picture, const cv::Mat& inside) {
  std::vector<float> over_green, over_blue;
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) {
      const auto& p = picture.at<cv::Vec3f>(y, x);
      const float sum = p[0] + p[1] + p[2];
      if (!inside.at<std::uint8_t>(y, x) || sum < kLeastSum) continue;
      over_green.push_back((p[0] - p[1]) / sum);
      over_blue.push_back((p[0] - p[2]) / sum);
    }
  if (over_green.empty()) return {};
  return {median(std::move(over_green)), median(std::move(over_blue))};
}

cv::Mat reduced_picture(const Rgb8Image& frame, cv::Size size) {
  cv::Mat small;
  cv_view(frame).convertTo(small, CV_32FC3);
  cv::resize(small, small, size, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(small, small, {3, 3}, 0);
  return small;
}

cv::Size reduced_size(int width, int height) {
  const double scale = std::min(1.0, double(kLongest_px) / std::max(width, height));
  return {std::max(1, static_cast<int>(std::lround(scale * width))),
          std::max(1, static_cast<int>(std::lround(scale * height)))};
}

ShaftView shaft_view(const Rgb8Image& frame, const Mask& inside) {
  const cv::Size size = reduced_size(frame.width, frame.height);
  const cv::Mat picture = reduced_picture(frame, size);
  ShaftView view;
  cv::resize(cv_view(inside), view.inside, size, 0, 0, cv::INTER_NEAREST);
  const TissueHue usual = usual_hue(picture, view.inside);
  if (usual.square() < kLeastHue * kLeastHue) return {};
  view.hue = cv::Mat::zeros(size, CV_32F);
  view.known = cv::Mat::zeros(size, CV_32F);
  view.level = cv::Mat::zeros(size, CV_32F);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      const auto& p = picture.at<cv::Vec3f>(y, x);
      const float sum = p[0] + p[1] + p[2];
      view.level.at<float>(y, x) = std::log(sum / 3 + 12);
      if (sum < kLeastSum) continue;
      view.known.at<float>(y, x) = 1;
      const double along = (p[0] - p[1]) * usual.over_green + (p[0] - p[2]) * usual.over_blue;
      view.hue.at<float>(y, x) = static_cast<float>(along / (sum * usual.square()));
    }
  return view;
}

void paint(const std::vector<cv::Point2d>& outline, double scale, cv::Mat& mask) {
  constexpr int kBits = 4;  // of a pixel's fraction
  std::vector<cv::Point> corners;
  // Corners are pixels' centres there.
  for (const cv::Point2d& p : outline)
    corners.emplace_back((scale * p - cv::Point2d(0.5, 0.5)) * (1 << kBits));
  if (!corners.empty())
    cv::fillPoly(mask, std::vector<std::vector<cv::Point>>{corners}, 1, cv::LINE_8, kBits);
}

}  // namespace

std::optional<Mask> find_instruments(const Rgb8Image& frame, const Mask& inside) {
  if (frame.width == 0 || frame.height == 0) return std::nullopt;
  const ShaftView view = shaft_view(frame, inside);
  if (view.hue.empty()) return std::nullopt;
  Mask found(frame.width, frame.height);
  cv::Mat mask = cv_view(found);
  for (const Shaft& shaft : find_shafts(view))
    paint(trace_outline(view, shaft), double(frame.width) / view.hue.cols, mask);
  return common(std::move(found), inside);
}

bool is_colourless(const Rgb8Image& frame, const Mask& inside) {
  if (frame.width == 0 || frame.height == 0) return true;
  return shaft_view(frame, inside).hue.empty();
}

}  // namespace organbake
