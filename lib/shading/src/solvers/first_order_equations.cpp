// SPDX-License-Identifier: GPL-3.0-or-later
// The linear systems of a Gauss–Newton step: image equations of first order in the unknown and its
// slopes, and the bending energy, solved by preconditioned conjugate gradients without a matrix in
// memory.
#include "solvers/first_order_equations.h"

#include <algorithm>
#include <cmath>

namespace organbake {
namespace {

// ln of the brightness falls by 2 with ln r: the inverse square.
constexpr float kZeroOrder = 2;

double dot(const Plane& a, const Plane& b) {
  // Eight partial sums in a fixed order: fast, and the same for everyone.
  float part[8];
  double sum = 0;
  constexpr std::size_t kBlock = 1024;
  for (std::size_t begin = 0; begin < a.size(); begin += kBlock) {
    const std::size_t end = std::min(a.size(), begin + kBlock);
    std::fill(std::begin(part), std::end(part), 0.F);
    std::size_t k = begin;
    for (; k + 8 <= end; k += 8)
      for (int i = 0; i < 8; ++i) part[i] += a.values[k + i] * b.values[k + i];
    for (; k < end; ++k) sum += double(a.values[k]) * b.values[k];
    for (float p : part) sum += p;
  }
  return sum;
}

}  // namespace

FirstOrderEquations::FirstOrderEquations(int width, int height, double step_x, double step_y)
    : slope_x(width, height),
      slope_y(width, height),
      weight(width, height),
      target(width, height),
      anchor(width, height),
      width_(width),
      height_(height),
      step_x_(step_x),
      step_y_(step_y),
      diagonal_(width, height),
      residual_(width, height),
      scaled_(width, height),
      direction_(width, height),
      image_(width, height),
      row_(static_cast<std::size_t>(width)) {}

void FirstOrderEquations::set_bending(double mu) {
  bend_xx_ = static_cast<float>(mu / std::pow(step_x_, 4));
  bend_yy_ = static_cast<float>(mu / std::pow(step_y_, 4));
  bend_xy_ = static_cast<float>(2 * mu / std::pow(step_x_ * step_y_, 2));
}

void FirstOrderEquations::hold(const Plane& at, const Plane& weight) {
  held_ = at;
  anchor = weight;
  anchored_ = true;
}

void FirstOrderEquations::data_forward(const Plane& delta) {
  for (int row = 0; row < height_; ++row) {
    const std::size_t at = delta.index(0, row);
    const float* here = &delta.values[at];
    const float* up = &delta.values[delta.index(0, before(row))];
    const float* down = &delta.values[delta.index(0, after(row, height_))];
    const float *sx = &slope_x.values[at], *sy = &slope_y.values[at], *w = &weight.values[at];
    float* out = &target.values[at];
    const auto one = [&](int i, int left, int right) {
      out[i] = w[i] * (kZeroOrder * here[i] + sx[i] * (here[right] - here[left]) +
                       sy[i] * (down[i] - up[i]));
    };
    one(0, 0, after(0, width_));
    for (int i = 1; i + 1 < width_; ++i) one(i, i - 1, i + 1);
    if (width_ > 1) one(width_ - 1, width_ - 2, width_ - 1);
  }
}

void FirstOrderEquations::data_adjoint(Plane& out) const {
  const int n = width_;
  const float z = kZeroOrder;
  for (int row = 0; row < height_; ++row) {
    const std::size_t at = out.index(0, row);
    const float *t = &target.values[at], *sx = &slope_x.values[at];
    float* o = &out.values[at];
    for (int i = 1; i + 1 < n; ++i) o[i] = z * t[i] + sx[i - 1] * t[i - 1] - sx[i + 1] * t[i + 1];
    if (n > 1) {
      o[0] = z * t[0] - sx[0] * t[0] - sx[1] * t[1];
      o[n - 1] = z * t[n - 1] + sx[n - 1] * t[n - 1] + sx[n - 2] * t[n - 2];
    } else {
      o[0] = z * t[0];
    }
    if (height_ == 1) continue;
    const auto add = [&](int other, float sign) {
      const float *to = &target.values[out.index(0, other)],
                  *so = &slope_y.values[out.index(0, other)];
      for (int i = 0; i < n; ++i) o[i] += sign * so[i] * to[i];
    };
    add(before(row), row > 0 ? 1.F : -1.F);
    add(after(row, height_), row + 1 < height_ ? -1.F : 1.F);
  }
}

void FirstOrderEquations::apply(const Plane& delta, Plane& out) {
  data_forward(delta);
  data_adjoint(out);
  add_bending(delta, 1, out);
}

// out += factor · R v, R the bending energy's matrix: every second difference times its transpose.
void FirstOrderEquations::add_bending(const Plane& v, float factor, Plane& out) {
  add_bending_rows(v, factor * bend_xx_, out);
  add_bending_columns(v, factor * bend_yy_, out);
  add_bending_twist(v, factor * bend_xy_, out);
  if (!anchored_) return;
  for (std::size_t k = 0; k < v.size(); ++k)
    out.values[k] += factor * anchor.values[k] * v.values[k];
}

void FirstOrderEquations::add_bending_rows(const Plane& v, float factor, Plane& out) {
  const int n = width_;
  float* b = row_.data();
  for (int row = 0; row < height_; ++row) {
    const float* h = &v.values[v.index(0, row)];
    float* o = &out.values[out.index(0, row)];
    for (int i = 1; i + 1 < n; ++i) b[i] = factor * (h[i - 1] - 2 * h[i] + h[i + 1]);
    for (int i = 1; i + 1 < n; ++i) o[i] -= 2 * b[i];
    for (int i = 1; i + 1 < n; ++i) o[i - 1] += b[i];
    for (int i = 1; i + 1 < n; ++i) o[i + 1] += b[i];
  }
}

void FirstOrderEquations::add_bending_columns(const Plane& v, float factor, Plane& out) const {
  const int n = width_;
  for (int row = 1; row + 1 < height_; ++row) {
    const float *u = &v.values[v.index(0, row - 1)], *h = u + n, *d = h + n;
    float *ou = &out.values[out.index(0, row - 1)], *oh = ou + n, *od = oh + n;
    for (int i = 0; i < n; ++i) {
      const float b = factor * (u[i] - 2 * h[i] + d[i]);
      ou[i] += b;
      oh[i] -= 2 * b;
      od[i] += b;
    }
  }
}

void FirstOrderEquations::add_bending_twist(const Plane& v, float factor, Plane& out) {
  const int n = width_;
  float* b = row_.data();
  for (int row = 0; row + 1 < height_; ++row) {
    const float *h = &v.values[v.index(0, row)], *d = h + n;
    float *oh = &out.values[out.index(0, row)], *od = oh + n;
    for (int i = 0; i + 1 < n; ++i) b[i] = factor * (h[i] - h[i + 1] - d[i] + d[i + 1]);
    for (int i = 0; i + 1 < n; ++i) {
      oh[i] += b[i];
      od[i] -= b[i];
    }
    for (int i = 0; i + 1 < n; ++i) {
      oh[i + 1] -= b[i];
      od[i + 1] += b[i];
    }
  }
}

void FirstOrderEquations::fill_diagonal() {
  const float zero2 = kZeroOrder * kZeroOrder;
  for (int row = 0; row < height_; ++row)
    for (int i = 0; i < width_; ++i) {
      const int in_x = (i + 1 < width_ && i > 0 ? 4 : 0) + (i > 1) + (i + 2 < width_);
      const int in_y = (row + 1 < height_ && row > 0 ? 4 : 0) + (row > 1) + (row + 2 < height_);
      const int in_xy = ((i > 0) + (i + 1 < width_)) * ((row > 0) + (row + 1 < height_));
      const std::size_t k = diagonal_.index(i, row);
      const float sx = slope_x.values[k], sy = slope_y.values[k];
      const float data = weight.values[k] * (zero2 + 2 * (sx * sx + sy * sy));
      const float sum =
          data + anchor.values[k] + bend_xx_ * in_x + bend_yy_ * in_y + bend_xy_ * in_xy;
      diagonal_.values[k] = std::max(sum, 1e-20F);
    }
}

double FirstOrderEquations::penalty(const Plane& v) {
  std::fill(image_.values.begin(), image_.values.end(), 0.F);
  add_bending(v, 1, image_);
  double cost = dot(v, image_);
  if (!anchored_) return cost;
  for (std::size_t k = 0; k < held_.size(); ++k)
    cost += double(anchor.values[k]) * held_.values[k] * (held_.values[k] - 2 * v.values[k]);
  return cost;
}

int FirstOrderEquations::solve(const Plane& v, int most_steps, Plane& delta) {
  const std::size_t n = v.size();
  anchored_ =
      std::any_of(anchor.values.begin(), anchor.values.end(), [](float a) { return a > 0; });
  data_adjoint(residual_);
  add_bending(v, -1, residual_);
  for (std::size_t k = 0; anchored_ && k < held_.size(); ++k)
    residual_.values[k] += anchor.values[k] * held_.values[k];
  fill_diagonal();
  for (std::size_t k = 0; k < n; ++k)
    direction_.values[k] = scaled_.values[k] = residual_.values[k] / diagonal_.values[k];
  std::fill(delta.values.begin(), delta.values.end(), 0.F);
  double rho = dot(residual_, scaled_);
  const double enough = 1e-8 * rho;
  int step = 0;
  while (step < most_steps && rho > enough) {
    ++step;
    apply(direction_, image_);
    const double curvature = dot(direction_, image_);
    if (!(curvature > 0)) break;
    const float alpha = static_cast<float>(rho / curvature);
    for (std::size_t k = 0; k < n; ++k) {
      delta.values[k] += alpha * direction_.values[k];
      residual_.values[k] -= alpha * image_.values[k];
      scaled_.values[k] = residual_.values[k] / diagonal_.values[k];
    }
    const double next = dot(residual_, scaled_);
    const float beta = static_cast<float>(next / rho);
    for (std::size_t k = 0; k < n; ++k)
      direction_.values[k] = scaled_.values[k] + beta * direction_.values[k];
    rho = next;
  }
  return step;
}

}  // namespace organbake
