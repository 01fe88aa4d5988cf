// SPDX-License-Identifier: GPL-3.0-or-later
// Instruments by what they are: shafts that come in from the rim of the field of view (see
// shaft_search). Colours are taken against the picture's own usual tissue, so that pale, smoky and
// dark pictures look alike here.
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "masks/shaft_outline.h"
#include "organbake/core/median.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/shading/masks.h"

namespace organbake {
namespace {

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
