// SPDX-License-Identifier: GPL-3.0-or-later
// Fast sweeping (Zhao 2005) for the eikonal-like equation of a lamp at the lens: Gauss–Seidel in
// four orders, upwind differences, so that the solution is found from its local minima outward
// without an initial guess.
#include "organbake/shading/fast_sweeping.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace organbake {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

// The nearer of two neighbours along one axis, and which way v rises from it.
struct Upwind {
  double value = kNone;
  double sign = 1;
};

// α(v−a)² + 2γ(v−a)(v−b) + β(v−b)²
struct Quadratic {
  double alpha, beta, gamma;

  // The v at which the form reaches `slope2`, by both neighbours when both lie below it.
  double rise_to(double a, double b, double slope2) const {
    const double one_sided = std::min(a + std::sqrt(slope2 / alpha), b + std::sqrt(slope2 / beta));
    if (one_sided <= std::max(a, b)) return one_sided;
    const double d = b - a, sum = alpha + 2 * gamma + beta, linear = (gamma + beta) * d;
    const double inner = linear * linear - sum * (beta * d * d - slope2);
    if (inner < 0) return one_sided;
    const double both = a + (linear + std::sqrt(inner)) / sum;
    return both >= std::max(a, b) ? both : one_sided;
  }
};

// T: what the ranges are kept in.
template <class T>
class Sweeper {
 public:
  Sweeper(const Plane& log_image, const Mask& inside, const RayGrid& rays, Grid<T>& v)
      : log_image_(log_image), inside_(inside), rays_(rays), v_(v) {}

  // One of the four orders; the largest change.
  double sweep(int order) {
    const bool right = order % 2 == 0, down = order / 2 == 0;
    double change = 0;
    for (int j = 0; j < v_.height; ++j) {
      const int y = down ? j : v_.height - 1 - j;
      for (int i = 0; i < v_.width; ++i) {
        const int x = right ? i : v_.width - 1 - i;
        if (!inside_.at(x, y)) continue;
        const T solved = static_cast<T>(solve(x, y));
        change = std::max(change, std::abs(double(solved) - v_.at(x, y)));
        v_.at(x, y) = solved;
      }
    }
    return change;
  }

 private:
  double value(int x, int y) const {
    if (x < 0 || y < 0 || x >= v_.width || y >= v_.height || !inside_.at(x, y)) return kNone;
    return v_.at(x, y);
  }
  static Upwind nearer(double before, double after) {
    return before <= after ? Upwind{before, 1} : Upwind{after, -1};
  }

  // v at a pixel from its upwind neighbours. The exponential is taken first at the nearest of them
  // and then at what comes out: over one pixel it changes by O(h), so twice is enough.
  double solve(int column, int row) const {
    const double log_i = log_image_.at(column, row), farthest = -0.5 * log_i;
    const Upwind a = nearer(value(column - 1, row), value(column + 1, row));
    const Upwind b = nearer(value(column, row - 1), value(column, row + 1));
    double v = std::min(a.value, b.value);
    // Brighter than any frontal surface behind its neighbours: a local minimum of the range.
    if (v >= farthest) return farthest;
    const double x = rays_.x(column), y = rays_.y(row), c = 1 + x * x + y * y;
    const Quadratic form = {c * (1 + x * x) / (rays_.step_x * rays_.step_x),
                            c * (1 + y * y) / (rays_.step_y * rays_.step_y),
                            c * x * y * a.sign * b.sign / (rays_.step_x * rays_.step_y)};
    for (int i = 0; i < 2; ++i) {
      const double slope2 = std::exp(-2 * log_i - 4 * v) - 1;
      v = std::min(farthest, form.rise_to(a.value, b.value, std::max(0.0, slope2)));
    }
    return v;
  }

  const Plane& log_image_;
  const Mask& inside_;
  const RayGrid& rays_;
  Grid<T>& v_;
};

template <class T>
int sweep_to_the_end(Sweeper<T> sweeper, int most_sweeps, double tolerance) {
  int sweeps = 0;
  double round = kNone;  // largest |Δv| since the first of the four orders
  while (sweeps < most_sweeps) {
    const int order = sweeps++ % 4;
    const double change = sweeper.sweep(order);
    round = order == 0 ? change : std::max(round, change);
    // All four orders must leave it alone, not just the one that ran last.
    if (order == 3 && round < tolerance) break;
  }
  return sweeps;
}

}  // namespace

Plane farthest_log_range(const Plane& log_image) {
  Plane v = log_image;
  for (float& value : v.values) value *= -0.5F;
  return v;
}

int sweep_log_range(const Plane& log_image, const Mask& inside, const RayGrid& rays, Plane& v,
                    int most_sweeps, double tolerance) {
  return sweep_to_the_end(Sweeper(log_image, inside, rays, v), most_sweeps, tolerance);
}

int sweep_log_range(const Plane& log_image, const Mask& inside, const RayGrid& rays,
                    Grid<double>& v, int most_sweeps, double tolerance) {
  return sweep_to_the_end(Sweeper(log_image, inside, rays, v), most_sweeps, tolerance);
}

}  // namespace organbake
