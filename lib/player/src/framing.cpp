// SPDX-License-Identifier: Apache-2.0
// A pose of the orbit that frames several organs: the eye is moved to the middle of what it sees
// and to the distance that fills the picture, again and again, since perspective changes both.
#include "organbake/player/framing.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace organbake {
namespace {

constexpr double kFilled = 0.9;  // of the picture's side
constexpr int kRounds = 12;  // each moves the eye into the middle and back: far more than enough

// Where the organs lie in a picture: from −1 to 1 across each side, and how far on the average.
struct Extent {
  Eigen::AlignedBox2d box;
  double mean_depth_mm = 0;
};
Extent extent_in(const View& view, const Player& player) {
  const Intrinsics& lens = view.camera.intrinsics;
  Extent extent;
  double count = 0;
  for (std::size_t o = 0; o < player.organ_count(); ++o) {
    for (const Eigen::Vector3d& vertex : player.bundle(o).proxy.vertices) {
      Eigen::Vector3d at = view.camera.camera_from_world * vertex;
      at.z() = std::max(at.z(), view.near_mm);
      extent.mean_depth_mm += at.z();
      ++count;
      extent.box.extend(Eigen::Vector2d(2 * lens.fx / lens.width * at.head<2>() / at.z()));
    }
  }
  extent.mean_depth_mm /= count;
  return extent;
}

}  // namespace

OrbitPose framing_pose(const Player& player) {
  OrbitPose pose;
  if (player.organ_count() == 1) return pose;
  const CameraSet& cameras = player.bundle().cameras;
  const double unit_mm =
      (cameras.cameras.front().center_world_mm() - cameras.manifold.center_world_mm).norm();
  constexpr int kSide = 100;
  for (int round = 0; round < kRounds; ++round) {
    const View view = orbit_view(cameras, pose, kSide, kSide);
    const Extent extent = extent_in(view, player);
    const Eigen::Vector2d middle = extent.box.center();
    // In multiples of the virtual cameras' distance: of the organs, and half a picture there.
    const double depth = extent.mean_depth_mm / unit_mm;
    const double half = 0.5 * kSide * depth / view.camera.intrinsics.fx;
    pose.right += half * middle.x();
    pose.up -= half * middle.y();
    const double nearer = extent.box.sizes().maxCoeff() / (2 * kFilled);
    pose.distance = std::max(pose.distance + (nearer - 1) * depth, 0.1 * pose.distance);
  }
  return pose;
}

}  // namespace organbake
