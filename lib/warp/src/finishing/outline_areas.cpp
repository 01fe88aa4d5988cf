// SPDX-License-Identifier: Apache-2.0
#include "organbake/warp/outline_areas.h"

#include <algorithm>
#include <cmath>

namespace organbake {

OutlineAreas areas_of_slope(int length, BorderStep before, BorderStep after, int i) {
  const double half = 0.5 * length;
  // Under a line that falls from half a pixel at the end to none in the middle.
  const auto area = [half](double from) {
    const double to = std::min(from + 1, half);
    return from < to ? (to - from) / 2 * (1 - (to + from) / (2 * half)) : 0;
  };
  const double left = area(i), right = area(length - 1 - i);
  return {(before == to_open ? left : 0) + (after == to_open ? right : 0),
          (before == to_skin ? left : 0) + (after == to_skin ? right : 0)};
}

OutlineAreas areas_of_bow(int length, BorderStep ends, double rise, int i) {
  // Of 1/2 − rise (1 − u²) along the stretch, u from −1 to 1.
  const auto integral = [&](double u) {
    return 0.5 * length * u * (0.5 - rise + rise * u * u / 3);
  };
  const double from = 2.0 * i / length - 1, to = 2.0 * (i + 1) / length - 1;
  const double crossing = rise > 0.5 ? std::sqrt(1 - 0.5 / rise) : 0;
  const double a = std::clamp(from, -crossing, crossing), b = std::clamp(to, -crossing, crossing);
  const double beyond = integral(a) - integral(b);
  const double before = integral(to) - integral(from) + beyond;
  return ends == to_open ? OutlineAreas{before, beyond} : OutlineAreas{beyond, before};
}

}  // namespace organbake
