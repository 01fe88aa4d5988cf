// SPDX-License-Identifier: GPL-3.0-or-later
#include "refine_crossings.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organbake/isosurface/isosurface.h"
#include "organbake/phantom/known_answers.h"
#include "shape_volumes.h"

namespace organbake {
namespace {

TriangleMesh surface_of(const Volume& ct, bool refine) {
  IsosurfaceOptions options;
  options.iso_hu = kBallHalfWay_hu;
  options.refine = refine;
  return extract_isosurface(ct, options).mesh;
}

TEST(RefineCrossings, PutsABallInThickSlicesInItsPlace) {
  constexpr double kRadius = 20;
  const Volume ct = scan_ball(kRadius, {0.7, 0.7, 3});
  const double linear = linear_crossing_rms_mm(ct, kRadius);
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
