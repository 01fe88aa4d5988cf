// SPDX-License-Identifier: Apache-2.0
#include "deform/nearest_on_triangle.h"

namespace organbake {
namespace {

double ratio(double part, double whole) { return whole > 0 ? part / whole : 0; }

}  // namespace

TriangleWeights nearest_on_triangle(const Lanes& p, const Lanes& a, const Lanes& b,
                                    const Lanes& c) {
  const Lanes ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {0, 0};
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return {1, 0};
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return {0, 1};

  const double weight_c = d1 * d4 - d3 * d2;
  if (weight_c <= 0 && d1 >= 0 && d3 <= 0) return {ratio(d1, d1 - d3), 0};
  const double weight_b = d5 * d2 - d1 * d6;
  if (weight_b <= 0 && d2 >= 0 && d6 <= 0) return {0, ratio(d2, d2 - d6)};
  const double weight_a = d3 * d6 - d5 * d4;
  if (weight_a <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double t = ratio(d4 - d3, (d4 - d3) + (d5 - d6));
    return {1 - t, t};
  }
  const double sum = weight_a + weight_b + weight_c;
  return {ratio(weight_b, sum), ratio(weight_c, sum)};
}

}  // namespace organbake
