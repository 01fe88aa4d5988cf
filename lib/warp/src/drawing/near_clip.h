// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>

#include "organbake/warp/rasteriser.h"

namespace organbake {

// A corner of what is left of a triangle: pixels × depth, and depth; its shares of the triangle's
// own corners.
struct ClippedCorner {
  Eigen::Vector3f at;
  std::array<float, 3> shares;
};

// What of a triangle lies behind the near plane (Sutherland & Hodgman 1974), in its order: three or
// four corners, or none.
struct ClippedTriangle {
  std::array<ClippedCorner, 4> corners;
  int count = 0;

  ClippedTriangle(const std::array<Eigen::Vector3f, 3>& triangle, float near_mm) {
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      const Eigen::Vector3f &a = triangle[k], &b = triangle[next];
      std::array<float, 3> shares{};
      shares[k] = 1;
      if (a.z() > near_mm) corners[count++] = {a, shares};
      if ((a.z() > near_mm) == (b.z() > near_mm)) continue;
      const float t = (near_mm - a.z()) / (b.z() - a.z());
      shares[k] = 1 - t, shares[next] = t;
      Eigen::Vector3f at = a + t * (b - a);
      at.z() = near_mm;
      corners[count++] = {at, shares};
    }
  }

  // Calls visit(SnappedTriangle, weights_in) for each triangle of it; weights_in() turns weights of
  // that one's corners into those of the whole one's.
  template <class Visit>
  void each(const Visit& visit) const {
    const auto snapped = [](const ClippedCorner& c) {
      return SnappedCorner({c.at.x() / c.at.z(), c.at.y() / c.at.z(), 1 / c.at.z()});
    };
    for (int k = 2; k < count; ++k) {
      const ClippedCorner &a = corners[0], &b = corners[k - 1], &c = corners[k];
      visit(SnappedTriangle(snapped(a), snapped(b), snapped(c)),
            [&](const std::array<float, 3>& part) {
              std::array<float, 3> whole;
              for (int i = 0; i < 3; ++i)
                whole[i] = part[0] * a.shares[i] + part[1] * b.shares[i] + part[2] * c.shares[i];
              return whole;
            });
    }
  }
};

}  // namespace organbake
