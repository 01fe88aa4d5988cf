// SPDX-License-Identifier: GPL-3.0-or-later
#include "isosurface/refine_crossings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "isosurface/isosurface.h"
#include "shape_volumes.h"

namespace organbake {
namespace {

constexpr double kAir_hu = -1000, kTissue_hu = 60;
constexpr double kHalfWay_hu = (kAir_hu + kTissue_hu) / 2;

// Share of a voxel's box inside a ball round the origin: exact along z, by midpoints across.
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

// A CT as a scanner sees it: every voxel is the mean over its box.
Volume partial_volume_ball(double radius, const Eigen::Vector3d& spacing_mm) {
  Volume ct = grid_around_origin(spacing_mm, 2 * radius + 20);
  for (int k = 0; k < ct.size[2]; ++k) {
    for (int j = 0; j < ct.size[1]; ++j) {
      for (int i = 0; i < ct.size[0]; ++i) {
        const double share =
            share_in_ball(ct.world_from_index(Eigen::Vector3d(i, j, k)), spacing_mm, radius);
        const double hu = kAir_hu + (kTissue_hu - kAir_hu) * share;
        ct.voxels.push_back(static_cast<std::int16_t>(std::lround(hu)));
      }
    }
  }
  return ct;
}

// RMS over the edges of the grid of where a straight line between two voxels crosses the level.
double linear_crossing_rms(const Volume& ct, double radius) {
  double squares = 0;
  std::size_t count = 0;
  for (int k = 0; k + 1 < ct.size[2]; ++k) {
    for (int j = 0; j + 1 < ct.size[1]; ++j) {
      for (int i = 0; i + 1 < ct.size[0]; ++i) {
        for (int axis = 0; axis < 3; ++axis) {
          Eigen::Vector3i next(i, j, k);
          ++next[axis];
          const double here = ct.at(i, j, k), there = ct.at(next.x(), next.y(), next.z());
          if ((here >= kHalfWay_hu) == (there >= kHalfWay_hu)) continue;
          Eigen::Vector3d index(i, j, k);
          index[axis] += (kHalfWay_hu - here) / (there - here);
          const double miss = ct.world_from_index(index).norm() - radius;
          squares += miss * miss;
          ++count;
        }
      }
    }
  }
  return std::sqrt(squares / static_cast<double>(count));
}

TriangleMesh surface_of(const Volume& ct, bool refine) {
  IsosurfaceOptions options;
  options.iso_hu = kHalfWay_hu;
  options.refine = refine;
  return extract_isosurface(ct, options).mesh;
}

TEST(RefineCrossings, PutsABallInThickSlicesInItsPlace) {
  constexpr double kRadius = 20;
  const Volume ct = partial_volume_ball(kRadius, {0.7, 0.7, 3});
  const double linear = linear_crossing_rms(ct, kRadius);
  EXPECT_GT(linear, 0.1);  // plain marching cubes: about 0.11 mm
  EXPECT_LE(radius_rms(surface_of(ct, false), kRadius), 1.02 * linear);
  const TriangleMesh refined = surface_of(ct, true);
  expect_closed_and_sound(refined);
  EXPECT_LE(radius_rms(refined, kRadius), 0.05);
}

// One row of voxels along z, repeated: the refined height of the surface between tissue and air.
double refined_height(const std::vector<std::int16_t>& column, double level) {
  Volume ct;
  ct.size = {2, 2, static_cast<int>(column.size())};
  for (const std::int16_t value : column) ct.voxels.insert(ct.voxels.end(), 4, value);
  TriangleMesh mesh = contour(std::span<const std::int16_t>(ct.voxels), ct.size, level);
  refine_crossings(mesh, ct, level);
  return mesh.vertices.front().z();
}

TEST(RefineCrossings, KnowsHowFullAVoxelIs) {
  constexpr double kExact = 1e-6;
  // Voxel 2 is full up to its share; its lower side lies at 1.5.
  for (const std::int16_t share : {60, 70, 90}) {
    EXPECT_NEAR(refined_height({100, 100, share, 0, 0}, 50), 1.5 + share / 100.0, kExact);
    EXPECT_NEAR(refined_height({0, 0, share, 100, 100}, 50), 2.5 - share / 100.0, kExact);
  }
  // Blurred alike to both sides, the edge stays where it was.
  EXPECT_NEAR(refined_height({100, 100, 80, 20, 0, 0}, 50), 2.5, kExact);
  // A level that is not half-way lies towards its own plateau: a voxel's ramp, 0.1 of it.
  EXPECT_NEAR(refined_height({100, 100, 70, 0, 0}, 60), 1.5 + 0.7 - 0.1, kExact);
}

TEST(RefineCrossings, LeavesWhatHasNoPlateaus) {
  const auto unrefined = [](double below, double above, double at) {
    return at + (below - 50) / (below - above);
  };
  constexpr double kSingle = 1e-6;
  // A wall thinner than a voxel, and a long slope.
  EXPECT_NEAR(refined_height({0, 60, 0, 0}, 50), unrefined(0, 60, 0), kSingle);
  std::vector<std::int16_t> slope;
  for (int i = 0; i < 14; ++i) slope.push_back(static_cast<std::int16_t>(113 - 9 * i));
  const int last_above = 7;
  EXPECT_NEAR(refined_height(slope, 49.5),
              last_above + (slope[7] - 49.5) / double(slope[7] - slope[8]) - 1 + 1, kSingle);
}

}  // namespace
}  // namespace organbake
