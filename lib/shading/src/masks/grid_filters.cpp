// SPDX-License-Identifier: GPL-3.0-or-later
// Filters of planes that the solvers share: means over windows, differences, noise by Immerkær's
// mask (1996), and pyramids, by which push–pull fills what is masked (Gortler et al. 1996).
#include "organbake/shading/grid_filters.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "organbake/core/quantile.h"
#include "organbake/shading/cv_grid.h"

namespace organbake {
namespace {

// Fourth order, from the values two and one before and one and two after.
double central(float v0, float v1, float v3, float v4) {
  return (8 * (double(v3) - v1) - (double(v4) - v0)) / 12;
}

// Weighted values of two neighbours in a coarse row, for a fine index.
struct Between {
  int low = 0;
  float share = 0;  // of low + 1; below 0 and above 1 extrapolates

  Between(int fine, int coarse_count) {
    if (coarse_count < 2) return;
    const double at = (fine - 0.5) / 2;
    low = std::clamp(static_cast<int>(std::floor(at)), 0, coarse_count - 2);
    share = static_cast<float>(at - low);
  }
};

// Every fine pixel with the coarse one that it is a part of.
template <class Visit>
void visit_quads(int width, int height, const Visit& visit) {
  for (int y = 0; y < (height + 1) / 2; ++y)
    for (int x = 0; x < (width + 1) / 2; ++x)
      for (int k = 0; k < 4; ++k) {
        const int fx = 2 * x + k % 2, fy = 2 * y + k / 2;
        if (fx < width && fy < height) visit(x, y, fx, fy);
      }
}

}  // namespace

Plane box_mean(const Plane& plane, const Mask& inside, int radius) {
  Plane sum(plane.width, plane.height), count(plane.width, plane.height);
  if (plane.size() == 0) return sum;
  for (std::size_t k = 0; k < plane.size(); ++k) {
    count.values[k] = inside.values[k] ? 1.F : 0.F;
    sum.values[k] = inside.values[k] ? plane.values[k] : 0.F;
  }
  const cv::Size window(2 * radius + 1, 2 * radius + 1);
  for (Plane* one : {&sum, &count}) {
    cv::Mat view = cv_view(*one);
    cv::boxFilter(view, view, CV_32F, window, {-1, -1}, /*normalize=*/false, cv::BORDER_CONSTANT);
  }
  for (std::size_t k = 0; k < sum.size(); ++k) {
    sum.values[k] = count.values[k] > 0.5F ? sum.values[k] / count.values[k] : 0;
  }
  return sum;
}

double median_inside(const Plane& plane, const Mask& inside) {
  std::vector<float> values;
  for (std::size_t k = 0; k < plane.size(); ++k)
    if (inside.values[k] && std::isfinite(plane.values[k])) values.push_back(plane.values[k]);
  return median(std::move(values));
}

double derivative_at(const float* v, int i, int n, std::ptrdiff_t stride) {
  const auto at = [&](int k) { return double(v[k * stride]); };
  if (n < 3) return n == 2 ? at(1) - at(0) : 0;
  if (i == 0) return -1.5 * at(0) + 2 * at(1) - 0.5 * at(2);
  if (i == n - 1) return 1.5 * at(i) - 2 * at(i - 1) + 0.5 * at(i - 2);
  if (i == 1 || i == n - 2) return 0.5 * (at(i + 1) - at(i - 1));
  return central(v[(i - 2) * stride], v[(i - 1) * stride], v[(i + 1) * stride],
                 v[(i + 2) * stride]);
}

void derivatives_along(const Plane& v, int row, std::vector<double>& by_x) {
  const int n = v.width;
  const float* here = &v.values[v.index(0, row)];
  by_x.resize(static_cast<std::size_t>(n));
  for (int i = 2; i + 2 < n; ++i)
    by_x[i] = central(here[i - 2], here[i - 1], here[i + 1], here[i + 2]);
  for (int i = 0; i < n; ++i)
    if (i < 2 || i + 2 >= n) by_x[i] = derivative_at(here, i, n, 1);
}

void derivatives_across(const Plane& v, int row, std::vector<double>& by_y) {
  const int n = v.width;
  by_y.resize(static_cast<std::size_t>(n));
  if (row < 2 || row + 2 >= v.height) {
    for (int i = 0; i < n; ++i) by_y[i] = derivative_at(&v.values[i], row, v.height, n);
    return;
  }
  const float *v0 = &v.values[v.index(0, row - 2)], *v1 = v0 + n, *v3 = v1 + 2 * n, *v4 = v3 + n;
  for (int i = 0; i < n; ++i) by_y[i] = central(v0[i], v1[i], v3[i], v4[i]);
}

double noise_level(const Plane& intensity, const Mask& inside) {
  std::vector<float> responses;
  // Of a large image a sample is enough.
  const int step = std::max(intensity.width, intensity.height) > 256 ? 3 : 1;
  for (int y = 1; y + 1 < intensity.height; y += step)
    for (int x = 1; x + 1 < intensity.width; x += step) {
      static constexpr int kWeights[3] = {1, -2, 1};
      float sum = 0;
      bool whole = true;
      for (int dy = 0; dy < 3; ++dy)
        for (int dx = 0; dx < 3; ++dx) {
          whole = whole && inside.at(x + dx - 1, y + dy - 1);
          sum += static_cast<float>(kWeights[dx] * kWeights[dy]) *
                 intensity.at(x + dx - 1, y + dy - 1);
        }
      if (whole) responses.push_back(std::abs(sum));
    }
  // The mask's weights have a root of squares of 6.
  return kSigmaOfMedianDeviation * median(std::move(responses)) / 6;
}

ShadedImage halved(const ShadedImage& fine) {
  ShadedImage coarse;
  coarse.rays = halved(fine.rays);
  const int width = coarse.rays.width, height = coarse.rays.height;
  coarse.intensity = coarse.variance = Plane(width, height);
  coarse.inside = Mask(width, height);
  visit_quads(fine.rays.width, fine.rays.height, [&](int x, int y, int fx, int fy) {
    if (!fine.inside.at(fx, fy)) return;
    coarse.intensity.at(x, y) += fine.intensity.at(fx, fy);
    coarse.variance.at(x, y) += fine.variance.at(fx, fy);
    ++coarse.inside.at(x, y);
  });
  for (std::size_t k = 0; k < coarse.inside.size(); ++k) {
    const float count = coarse.inside.values[k];
    coarse.variance.values[k] = count > 0 ? coarse.variance.values[k] / (count * count) : 1;
    if (count > 0) coarse.intensity.values[k] /= count;
    coarse.inside.values[k] = count > 0;
  }
  return coarse;
}

Plane centre_values(const Plane& means, const Mask& inside, int halvings) {
  const float factor = static_cast<float>((1 - std::pow(0.25, halvings)) / 24);
  Plane centres = means;
  for (int y = 1; y + 1 < means.height; ++y)
    for (int x = 1; x + 1 < means.width; ++x) {
      if (!inside.at(x - 1, y) || !inside.at(x + 1, y) || !inside.at(x, y - 1) ||
          !inside.at(x, y + 1))
        continue;
      centres.at(x, y) -= factor * (means.at(x - 1, y) + means.at(x + 1, y) + means.at(x, y - 1) +
                                    means.at(x, y + 1) - 4 * means.at(x, y));
      centres.at(x, y) = std::max(centres.at(x, y), 0.F);
    }
  return centres;
}

Plane halved(const Plane& fine) {
  Plane coarse((fine.width + 1) / 2, (fine.height + 1) / 2), count = coarse;
  visit_quads(fine.width, fine.height, [&](int x, int y, int fx, int fy) {
    coarse.at(x, y) += fine.at(fx, fy);
    ++count.at(x, y);
  });
  for (std::size_t k = 0; k < coarse.size(); ++k) coarse.values[k] /= count.values[k];
  return coarse;
}

Plane doubled(const Plane& coarse, int width, int height) {
  Plane fine(width, height);
  std::vector<Between> columns;
  columns.reserve(static_cast<std::size_t>(width));
  for (int x = 0; x < width; ++x) columns.emplace_back(x, coarse.width);
  for (int y = 0; y < height; ++y) {
    const Between v(y, coarse.height);
    const int next_row = std::min(v.low + 1, coarse.height - 1);
    for (int x = 0; x < width; ++x) {
      const Between& u = columns[static_cast<std::size_t>(x)];
      const int next = std::min(u.low + 1, coarse.width - 1);
      const float top = (1 - u.share) * coarse.at(u.low, v.low) + u.share * coarse.at(next, v.low);
      const float bottom =
          (1 - u.share) * coarse.at(u.low, next_row) + u.share * coarse.at(next, next_row);
      fine.at(x, y) = (1 - v.share) * top + v.share * bottom;
    }
  }
  return fine;
}

void fill_outside(Plane& plane, const Mask& inside) {
  if (std::find(inside.values.begin(), inside.values.end(), 0) == inside.values.end()) return;
  if (plane.size() <= 1) {
    std::fill(plane.values.begin(), plane.values.end(), 0.F);
    return;
  }
  Plane coarse((plane.width + 1) / 2, (plane.height + 1) / 2), count = coarse;
  visit_quads(plane.width, plane.height, [&](int x, int y, int fx, int fy) {
    if (!inside.at(fx, fy)) return;
    coarse.at(x, y) += plane.at(fx, fy);
    ++count.at(x, y);
  });
  Mask known(coarse.width, coarse.height);
  for (std::size_t k = 0; k < coarse.size(); ++k) {
    known.values[k] = count.values[k] > 0;
    if (known.values[k]) coarse.values[k] /= count.values[k];
  }
  fill_outside(coarse, known);
  const Plane smooth = doubled(coarse, plane.width, plane.height);
  for (std::size_t k = 0; k < plane.size(); ++k)
    if (!inside.values[k]) plane.values[k] = smooth.values[k];
}

// Brightness against its surroundings, in standard deviations of them: what stays the same when the
// lamp comes nearer or the gain changes, so that frames and eyes can be compared by it.
namespace {

constexpr int kSurroundings_px = 10;  // radius; texture of tissue is finer
constexpr float kNoise = 1.0F;        // levels: what is no stronger than noise stays weak

}  // namespace

Plane grey_levels(const Rgb8Image& color) {
  Plane grey(color.width, color.height);
  cv::Mat levels;
  cv::cvtColor(cv_view(color), levels, cv::COLOR_RGB2GRAY);
  levels.convertTo(cv_view(grey), CV_32F);
  return grey;
}

Plane local_pattern(const Plane& grey, const Mask& counts) {
  Plane pattern(grey.width, grey.height);
  const cv::Mat levels = cv_view(grey);
  cv::Mat weight, mean, square;
  cv_view(counts).convertTo(weight, CV_32F);
  const cv::Size window(2 * kSurroundings_px + 1, 2 * kSurroundings_px + 1);
  const auto sum_around = [&](const cv::Mat& values, cv::Mat& sums) {
    cv::boxFilter(values, sums, CV_32F, window, {-1, -1}, true, cv::BORDER_CONSTANT);
  };
  const cv::Mat counted = levels.mul(weight);
  sum_around(counted, mean);
  sum_around(counted.mul(levels), square);
  cv::Mat share;
  sum_around(weight, share);
  for (int y = 0; y < grey.height; ++y)
    for (int x = 0; x < grey.width; ++x) {
      if (!counts.at(x, y)) continue;
      const float n = share.at<float>(y, x), m = mean.at<float>(y, x) / n;
      const float variance = std::max(0.F, square.at<float>(y, x) / n - m * m);
      pattern.at(x, y) = (grey.at(x, y) - m) / std::sqrt(variance + kNoise * kNoise);
    }
  return pattern;
}

void halve_counted(Plane& grey, Mask& counts) {
  const int width = grey.width / 2, height = grey.height / 2;
  Plane half(width, height);
  Mask half_counts(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      float sum = 0, all = 0;
      int counted = 0;
      for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i) {
          const float value = grey.at(2 * x + i, 2 * y + j);
          const bool one = counts.at(2 * x + i, 2 * y + j) != 0;
          all += value;
          sum += one ? value : 0;
          counted += one;
        }
      half.at(x, y) = counted > 0 ? sum / static_cast<float>(counted) : all / 4;
      half_counts.at(x, y) = counted >= 3;
    }
  grey = std::move(half);
  counts = std::move(half_counts);
}

// Weighted least-squares planes round every pixel at once: the moments of the window are
// convolutions, so that the cost does not grow with the window.
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
