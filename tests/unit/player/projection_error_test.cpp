// SPDX-License-Identifier: Apache-2.0
#include "player/projection_error.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "organ_to_play.h"
#include "player/orbit.h"

namespace organbake {
namespace {

// Maps of 128² on a picture of 256²: bilinear lookup between texels of about 1.2 mm on a surface
// with lumps stays within a small part of a pixel, while 80 flat faces are off by whole ones.
constexpr double kImageBasedPx = 0.2;
constexpr double kPolygonsPx = 0.8;
// Where a camera grazes the skin a texel's worth of depth, 1.2 mm, is in doubt: 2 pixels from the
// side. A vertex taken for the surface before it, from over the horizon, would be off by more.
constexpr double kGrazingPx = 2;

class ProjectionErrorTest : public testing::Test {
 protected:
  CarriedSurface truth_{organ_options().organ.mesh(5), organ_to_play().proxy};
  ProjectionComparison comparison_{organ_to_play(), truth_};
};

TEST_F(ProjectionErrorTest, ImageBasedBeatsPolygonsAllRound) {
  for (const double angle : {0.0, 0.7, 1.9, 2.45}) {
    const View view = orbit_view(organ_to_play().cameras, {angle}, 256, 256);
    const ProjectionErrors e = comparison_.measure(organ_to_play().proxy.vertices, view);
    EXPECT_GT(e.visible, truth_.at_rest().vertices.size() / 4);
    EXPECT_GT(e.image_based.vertices, 8 * e.visible / 10);  // the rest lies at silhouettes
    EXPECT_EQ(e.without_map + e.image_based.vertices, e.visible);
    EXPECT_LT(e.image_based.mean_px, kImageBasedPx) << angle;
    EXPECT_LT(e.image_based.max_px, kGrazingPx) << angle;
    EXPECT_GT(e.polygons.mean_px, kPolygonsPx) << angle;
  }
}

TEST_F(ProjectionErrorTest, StaysSmallUnderADent) {
  const Bundle& organ = organ_to_play();
  const auto positions = dented(organ.proxy, organ.cameras.manifold.directions[0], 15);
  const View view = orbit_view(organ.cameras, {0.7}, 256, 256);
  EXPECT_LT(comparison_.measure(positions, view).image_based.mean_px, kImageBasedPx);
}

TEST_F(ProjectionErrorTest, NoticesAWrongDepth) {
  Bundle wrong = organ_to_play();
  for (CameraMaps& maps : wrong.maps) {
    for (float& depth : maps.depth_mm) depth += 1.0f;  // a millimetre along every ray
  }
  const ProjectionComparison comparison(wrong, truth_);
  const View view = orbit_view(wrong.cameras, {0.7}, 256, 256);
  const double right = comparison_.measure(wrong.proxy.vertices, view).image_based.mean_px;
  EXPECT_GT(comparison.measure(wrong.proxy.vertices, view).image_based.mean_px, right + 0.2);
}

}  // namespace
}  // namespace organbake
