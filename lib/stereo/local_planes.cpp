// SPDX-License-Identifier: GPL-3.0-or-later
#include "stereo/local_planes.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "shading/cv_grid.h"

namespace organbake {
namespace {

// Box sums of products, in single precision: values count from one of their own, columns and rows
// from the picture's middle in units of the radius.
cv::Mat tent_mean(cv::Mat values, int radius) {
  const cv::Size window(2 * radius + 1, 2 * radius + 1);
  cv::boxFilter(values, values, CV_32F, window, {-1, -1}, true, cv::BORDER_CONSTANT);
  cv::boxFilter(values, values, CV_32F, window, {-1, -1}, true, cv::BORDER_CONSTANT);
  return values;
}

}  // namespace

struct LocalPlanes::Moments {
  int middle_x = 0, middle_y = 0, radius = 1;
  float offset = 0;
  cv::Mat n, x, y, xx, xy, yy, v, vx, vy, vv;
};

LocalPlanes::LocalPlanes(const Plane& value, const Plane& weight, int radius_px) {
  auto m = std::make_unique<Moments>();
  m->middle_x = value.width / 2;
  m->middle_y = value.height / 2;
  m->radius = radius_px;
  double sum = 0, count = 0;
  for (std::size_t k = 0; k < value.size(); ++k) {
    if (!(weight.values[k] > 0)) continue;
    sum += value.values[k];
    count += 1;
  }
  m->offset = static_cast<float>(count > 0 ? sum / count : 0);
  cv::Mat column(value.height, value.width, CV_32F), row = column.clone(), v = column.clone();
  for (int j = 0; j < value.height; ++j)
    for (int i = 0; i < value.width; ++i) {
      column.at<float>(j, i) = static_cast<float>(i - m->middle_x) / static_cast<float>(radius_px);
      row.at<float>(j, i) = static_cast<float>(j - m->middle_y) / static_cast<float>(radius_px);
      v.at<float>(j, i) = weight.at(i, j) > 0 ? value.at(i, j) - m->offset : 0;
    }
  const cv::Mat w = cv_view(weight), wx = w.mul(column), wy = w.mul(row), wv = w.mul(v);
  const auto mean = [&](const cv::Mat& values) { return tent_mean(values, radius_px); };
  m->n = mean(w.clone());
  m->xx = mean(wx.mul(column));
  m->xy = mean(wx.mul(row));
  m->yy = mean(wy.mul(row));
  m->vx = mean(wv.mul(column));
  m->vy = mean(wv.mul(row));
  m->vv = mean(wv.mul(v));
  m->x = mean(wx);
  m->y = mean(wy);
  m->v = mean(wv);
  moments_ = std::move(m);
}
LocalPlanes::~LocalPlanes() = default;

float LocalPlanes::weight(int x, int y) const { return moments_->n.at<float>(y, x); }

LocalPlanes::Fit LocalPlanes::at(int x, int y) const {
  // Of a radius squared: holds the slope back where what counts hardly spans a plane.
  constexpr double kHeldBack = 0.005;
  const Moments& m = *moments_;
  const double n = m.n.at<float>(y, x);
  const double mx = m.x.at<float>(y, x) / n, my = m.y.at<float>(y, x) / n;
  const double mv = m.v.at<float>(y, x) / n;
  const double xx = m.xx.at<float>(y, x) / n - mx * mx + kHeldBack;
  const double yy = m.yy.at<float>(y, x) / n - my * my + kHeldBack;
  const double xy = m.xy.at<float>(y, x) / n - mx * my;
  const double vx = m.vx.at<float>(y, x) / n - mv * mx, vy = m.vy.at<float>(y, x) / n - mv * my;
  const double determinant = xx * yy - xy * xy;
  const double p = (vx * yy - vy * xy) / determinant, q = (vy * xx - vx * xy) / determinant;
  const double to_x = double(x - m.middle_x) / m.radius - mx;
  const double to_y = double(y - m.middle_y) / m.radius - my;
  const double variance = m.vv.at<float>(y, x) / n - mv * mv - p * vx - q * vy;
  return {static_cast<float>(m.offset + mv + p * to_x + q * to_y),
          static_cast<float>(std::max(0.0, variance))};
}

}  // namespace organbake
