// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/grid_filters.h"

namespace organbake {
namespace {

// Fourth order, from the values two and one before and one and two after.
double central(float v0, float v1, float v3, float v4) {
  return (8 * (double(v3) - v1) - (double(v4) - v0)) / 12;
}

}  // namespace

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

}  // namespace organbake
