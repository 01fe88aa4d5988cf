// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/carried_surface.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "organ_to_play.h"
#include "organbake/core/error.h"
#include "organbake/player/orbit.h"

namespace organbake {
namespace {

class CarriedSurfaceTest : public testing::Test {
 protected:
  CarriedSurface truth_{organ_options().organ.mesh(4), organ_to_play().shell()};
  View view_ = orbit_view(organ_to_play().cameras, {}, 96, 96);
};

TEST_F(CarriedSurfaceTest, RestsWhereItWas) {
  const auto carried = truth_.carry(organ_to_play().proxy.vertices);
  constexpr double kRoundingMm = 1e-6;
  for (std::size_t v = 0; v < carried.size(); ++v) {
    EXPECT_LT((carried[v] - truth_.at_rest().vertices[v]).norm(), kRoundingMm);
  }
}

TEST_F(CarriedSurfaceTest, SeesTheHalfThatFacesTheEye) {
  const auto& rest = truth_.at_rest().vertices;
  const auto seen = truth_.visible(rest, view_);
  const Eigen::Vector3d center = organ_options().organ.center,
                        to_eye = (view_.camera.center_world_mm() - center).normalized();
  for (std::size_t v = 0; v < rest.size(); ++v) {
    const double side = (rest[v] - center).normalized().dot(to_eye);
    if (side > 0.6) {
      EXPECT_TRUE(seen[v]) << v;
    }
    if (side < -0.1) {
      EXPECT_FALSE(seen[v]) << v;
    }
  }
}

TEST_F(CarriedSurfaceTest, DrawsRaysInsideAndOutside) {
  const TruthFrame frame = truth_.draw(truth_.at_rest().vertices, view_, {10, 20, 30});
  EXPECT_EQ(frame.covered[0], 0);
  EXPECT_EQ(frame.color.at(0, 0)[1], 20);
  const std::size_t middle = 48 * 96 + 48;
  EXPECT_EQ(frame.covered[middle], TruthFrame::kRaysPerPixel);
  EXPECT_LT(frame.shell_face[middle], organ_to_play().proxy.faces.size());
  const auto partly = std::count_if(frame.covered.begin(), frame.covered.end(), [](int rays) {
    return rays > 0 && rays < TruthFrame::kRaysPerPixel;
  });
  EXPECT_GT(partly, 50);  // a silhouette of some 200 pixels is smooth
}

TEST_F(CarriedSurfaceTest, RefusesWhatItCannotShow) {
  EXPECT_THROW(CarriedSurface(TriangleMesh(), organ_to_play().shell()), BadDataError);
  TriangleMesh grey = truth_.at_rest();
  grey.colors.clear();
  const CarriedSurface colourless(grey, organ_to_play().shell());
  EXPECT_THROW(colourless.draw(grey.vertices, view_, {0, 0, 0}), BadDataError);
}

}  // namespace
}  // namespace organbake
