// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/phantom/ball_scan.h"

#include <algorithm>
#include <cmath>

namespace organbake {
namespace {

constexpr double kMargin_mm = 10;
constexpr double kOffCentre_voxels = 0.37;

// Share of a voxel's box inside the ball: exact along z, by midpoints across.
double share_in_ball(const Eigen::Vector3d& at, const Eigen::Vector3d& box, double radius) {
  if (at.norm() > radius + box.norm()) return 0;
  if (at.norm() < radius - box.norm()) return 1;
  constexpr int kColumns = 8;
  double inside = 0;
  for (int a = 0; a < kColumns; ++a) {
    for (int b = 0; b < kColumns; ++b) {
      const double x = at.x() + ((a + 0.5) / kColumns - 0.5) * box.x();
      const double y = at.y() + ((b + 0.5) / kColumns - 0.5) * box.y();
      const double half = std::sqrt(std::max(0.0, radius * radius - x * x - y * y));
      const double low = std::max(-half, at.z() - box.z() / 2);
      const double high = std::min(half, at.z() + box.z() / 2);
      inside += std::max(0.0, high - low) / box.z();
    }
  }
  return inside / (kColumns * kColumns);
}

Volume empty_grid(double extent_mm, const Eigen::Vector3d& spacing_mm) {
  Volume volume;
  volume.spacing_mm = spacing_mm;
  Eigen::Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    volume.size[axis] = 2 * static_cast<int>(std::ceil(extent_mm / spacing_mm[axis] / 2)) + 1;
    middle[axis] = (volume.size[axis] - 1) / 2.0 + kOffCentre_voxels;
  }
  volume.origin_mm = -spacing_mm.cwiseProduct(middle);
  return volume;
}

}  // namespace

Volume scan_ball(double radius_mm, const Eigen::Vector3d& spacing_mm) {
  Volume ct = empty_grid(2 * (radius_mm + kMargin_mm), spacing_mm);
  for (int k = 0; k < ct.size[2]; ++k) {
    for (int j = 0; j < ct.size[1]; ++j) {
      for (int i = 0; i < ct.size[0]; ++i) {
        const double share =
            share_in_ball(ct.world_from_index(Eigen::Vector3d(i, j, k)), spacing_mm, radius_mm);
        const double hu = kBallAir_hu + (kBallTissue_hu - kBallAir_hu) * share;
        ct.voxels.push_back(static_cast<std::int16_t>(std::lround(hu)));
      }
    }
  }
  return ct;
}

double linear_crossing_rms_mm(const Volume& ball, double radius_mm) {
  double squares = 0;
  std::size_t count = 0;
  for (int k = 0; k + 1 < ball.size[2]; ++k) {
    for (int j = 0; j + 1 < ball.size[1]; ++j) {
      for (int i = 0; i + 1 < ball.size[0]; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
          Eigen::Vector3i next(i, j, k);
          ++next[axis];
          const double here = ball.at(i, j, k), there = ball.at(next.x(), next.y(), next.z());
          if ((here >= kBallHalfWay_hu) == (there >= kBallHalfWay_hu)) continue;
          Eigen::Vector3d index(i, j, k);
          index[axis] += (kBallHalfWay_hu - here) / (there - here);
          const double miss = ball.world_from_index(index).norm() - radius_mm;
          squares += miss * miss;
          ++count;
        }
      }
    }
  }
  return std::sqrt(squares / static_cast<double>(count));
}

}  // namespace organbake
