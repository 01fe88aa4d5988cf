// SPDX-License-Identifier: GPL-3.0-or-later
// Weighted least-squares planes round every pixel at once: the moments of the window are
// convolutions, so that the cost does not grow with the window.
#include "organbake/shading/grid_filters.h"

#include <algorithm>
#include <opencv2/core.hpp>

#include "organbake/shading/tent_mean.h"

namespace organbake {
namespace {

// A window sees no more of a smooth surface than so many pixels to each side tell it.
constexpr int kEnough_px = 4;

// Sums over squares of pixels: of the weights w, of w times the value and times its square.
struct Squares {
  cv::Mat weight, value, square;
};

Squares squares_of(const Plane& value, const Plane& weight, int side_px, float offset) {
  const int width = (value.width + side_px - 1) / side_px;
  const int height = (value.height + side_px - 1) / side_px;
  Squares sums{cv::Mat::zeros(height, width, CV_32F), cv::Mat::zeros(height, width, CV_32F),
               cv::Mat::zeros(height, width, CV_32F)};
  for (int y = 0; y < value.height; ++y) {
    auto* n = sums.weight.ptr<float>(y / side_px);
    auto* first = sums.value.ptr<float>(y / side_px);
    auto* second = sums.square.ptr<float>(y / side_px);
    for (int x = 0; x < value.width; ++x) {
      const float w = weight.at(x, y);
      if (!(w > 0)) continue;
      const float v = value.at(x, y) - offset;
      n[x / side_px] += w;
      first[x / side_px] += w * v;
      second[x / side_px] += w * v * v;
    }
  }
  return sums;
}

float mean_of_counting(const Plane& value, const Plane& weight) {
  double sum = 0, count = 0;
  for (std::size_t k = 0; k < value.size(); ++k) {
    if (!(weight.values[k] > 0)) continue;
    sum += value.values[k];
    count += 1;
  }
  return static_cast<float>(count > 0 ? sum / count : 0);
}

}  // namespace

// In single precision: values count from one of their own, columns and rows from the picture's
// middle in units of the radius.
struct LocalPlanes::Moments {
  int side_px = 1;  // of the squares
  double middle_x = 0, middle_y = 0, radius_px = 1;
  float offset = 0;
  cv::Mat n, x, y, xx, xy, yy, v, vx, vy, vv;

  // Of a square's middle.
  double across(int square, double middle) const {
    return (side_px * square + 0.5 * (side_px - 1) - middle) / radius_px;
  }
};

LocalPlanes::LocalPlanes(const Plane& value, const Plane& weight, int radius_px) {
  auto m = std::make_unique<Moments>();
  m->middle_x = value.width / 2;
  m->middle_y = value.height / 2;
  m->side_px = std::max(1, radius_px / kEnough_px);
  m->offset = mean_of_counting(value, weight);
  const int radius = std::max(1, radius_px / m->side_px);
  m->radius_px = double(radius) * m->side_px;
  const Squares squares = squares_of(value, weight, m->side_px, m->offset);
  const cv::Mat& w = squares.weight;
  cv::Mat column(w.size(), CV_32F), row(w.size(), CV_32F);
  for (int j = 0; j < w.rows; ++j)
    for (int i = 0; i < w.cols; ++i) {
      column.at<float>(j, i) = static_cast<float>(m->across(i, m->middle_x));
      row.at<float>(j, i) = static_cast<float>(m->across(j, m->middle_y));
    }
  const double per_pixel = 1.0 / (double(m->side_px) * m->side_px);
  const auto mean = [&](const cv::Mat& sums) { return tent_mean(sums, radius); };
  const cv::Mat wx = w.mul(column), wy = w.mul(row), &wv = squares.value;
  m->n = mean(w * per_pixel);
  m->x = mean(wx * per_pixel);
  m->y = mean(wy * per_pixel);
  m->v = mean(wv * per_pixel);
  m->xx = mean(wx.mul(column, per_pixel));
  m->xy = mean(wx.mul(row, per_pixel));
  m->yy = mean(wy.mul(row, per_pixel));
  m->vx = mean(wv.mul(column, per_pixel));
  m->vy = mean(wv.mul(row, per_pixel));
  m->vv = mean(squares.square * per_pixel);
  moments_ = std::move(m);
}
LocalPlanes::~LocalPlanes() = default;

float LocalPlanes::weight(int x, int y) const {
  return moments_->n.at<float>(y / moments_->side_px, x / moments_->side_px);
}

LocalPlanes::Fit LocalPlanes::at(int x, int y) const {
  // Of a radius squared: holds the slope back where what counts hardly spans a plane.
  constexpr double kHeldBack = 0.005;
  const Moments& m = *moments_;
  const int i = x / m.side_px, j = y / m.side_px;
  const double n = m.n.at<float>(j, i);
  const double mx = m.x.at<float>(j, i) / n, my = m.y.at<float>(j, i) / n;
  const double mv = m.v.at<float>(j, i) / n;
  const double xx = m.xx.at<float>(j, i) / n - mx * mx + kHeldBack;
  const double yy = m.yy.at<float>(j, i) / n - my * my + kHeldBack;
  const double xy = m.xy.at<float>(j, i) / n - mx * my;
  const double vx = m.vx.at<float>(j, i) / n - mv * mx, vy = m.vy.at<float>(j, i) / n - mv * my;
  const double determinant = xx * yy - xy * xy;
  const double p = (vx * yy - vy * xy) / determinant, q = (vy * xx - vx * xy) / determinant;
  const double to_x = (x - m.middle_x) / m.radius_px - mx;
  const double to_y = (y - m.middle_y) / m.radius_px - my;
  const double variance = m.vv.at<float>(j, i) / n - mv * mv - p * vx - q * vy;
  return {static_cast<float>(m.offset + mv + p * to_x + q * to_y),
          static_cast<float>(std::max(0.0, variance))};
}

}  // namespace organbake
