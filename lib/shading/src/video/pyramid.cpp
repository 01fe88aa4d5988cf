// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/shading/grid_filters.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace organbake {
namespace {

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

}  // namespace organbake
