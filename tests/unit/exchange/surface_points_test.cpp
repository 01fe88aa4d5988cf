// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/exchange/surface_points.h"

#include <gtest/gtest.h>

#include <cmath>

#include "organ_to_export.h"
#include "organbake/image/srgb.h"

namespace organbake {
namespace {

TEST(SurfacePoints, LieOnTheOrganInItsColours) {
  const std::vector<SparsePoint> points = surface_points(organ_to_export(), 1);
  EXPECT_GT(points.size(), 10000u);
  constexpr double kOnSurface_mm = 0.01;  // a depth is a float, seen at up to 80°
  double worst_mm = 0, worst_color = 0;
  for (const SparsePoint& point : points) {
    worst_mm = std::max(worst_mm, off_surface_mm(point.place_mm));
    const Eigen::Vector3f color = export_options().organ.color(point.place_mm);
    for (int k = 0; k < 3; ++k)
      worst_color =
          std::max<double>(worst_color, std::abs(point.srgb[k] - srgb8_from_linear(color[k])));
  }
  EXPECT_LT(worst_mm, kOnSurface_mm);
  EXPECT_LE(worst_color, 1) << "one ray a texel: the texel's colour is the place's own";
}

TEST(SurfacePoints, AreSeenWhereNothingHidesThem) {
  const Bundle& bundle = organ_to_export();
  std::size_t sightings = 0, hidden = 0;
  for (const SparsePoint& point : surface_points(bundle, 4)) {
    EXPECT_GE(point.seen.size(), 1u);
    for (const SparsePoint::Sighting& seen : point.seen) {
      const PosedCamera& camera = bundle.cameras.cameras[seen.image];
      EXPECT_LT((project(camera, point.place_mm) - seen.pixel).norm(), 1e-9);
      const Eigen::Vector3d eye = camera.center_world_mm();
      const double to_skin = export_options().organ.trace(eye, point.place_mm - eye);
      ++sightings;
      hidden += to_skin < 0.98;  // 5 mm of about 250 before it
    }
  }
  EXPECT_GT(sightings, 1000u);
  EXPECT_LT(double(hidden), 0.001 * double(sightings)) << "half a texel at an edge decides";
}

TEST(SurfacePoints, AreNoMoreThanWanted) {
  const std::size_t all = surface_points(organ_to_export(), 2).size();
  const std::size_t few = surface_points(organ_to_export(), 2, 2000).size();
  EXPECT_GT(all, 4000u);
  EXPECT_LE(few, 2000u);
  EXPECT_GT(few, 1000u) << "the grid is coarsened no more than it takes";
}

}  // namespace
}  // namespace organbake
