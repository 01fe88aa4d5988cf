// SPDX-License-Identifier: Apache-2.0
#include "organbake/player/framing.h"

#include <gtest/gtest.h>

#include "organ_to_play.h"

namespace organbake {
namespace {

TEST(Framing, HasAllOrgansInThePictureAndFillsIt) {
  Bundle other = organ_to_play();
  for (Eigen::Vector3d& v : other.proxy.vertices) v += Eigen::Vector3d(-70, 90, 160);
  const Player player(std::vector<Bundle>{organ_to_play(), other});
  for (const auto& [width, height] : {std::pair(200, 200), {300, 200}, {200, 400}}) {
    const View view = orbit_view(player.bundle().cameras, framing_pose(player), width, height);
    double nearest_border = 1;
    for (std::size_t o = 0; o < 2; ++o) {
      for (const Eigen::Vector3d& v : player.bundle(o).proxy.vertices) {
        const Eigen::Vector2d at = project(view.camera, v).array() / Eigen::Array2d(width, height);
        for (const double share : {at.x(), 1 - at.x(), at.y(), 1 - at.y()}) {
          EXPECT_GT(share, 0.04);
          nearest_border = std::min(nearest_border, share);
        }
      }
    }
    EXPECT_TRUE(width != height || nearest_border < 0.06) << nearest_border;
  }
}

TEST(Framing, LeavesOneOrganToItsCameras) {
  const OrbitPose pose = framing_pose(Player(organ_to_play()));
  EXPECT_EQ(pose.distance, 1);
  EXPECT_EQ(pose.right, 0);
}

}  // namespace
}  // namespace organbake
