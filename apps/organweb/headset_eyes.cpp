// SPDX-License-Identifier: Apache-2.0
#include "headset_eyes.h"

namespace organbake {
namespace {

constexpr double kAway_mm = 500, kPerMetre_mm = 1000;

RigidTransform in_mm(const Eigen::Matrix4d& metres) {
  return {metres.topLeftCorner<3, 3>(), kPerMetre_mm * metres.topRightCorner<3, 1>()};
}

// From y up and z backward to y down and z ahead, and back.
const RigidTransform kTurnedOver = {Eigen::Vector3d(1, -1, -1).asDiagonal()};

}  // namespace

void HeadsetEyes::place(const Eigen::Matrix4d& room_from_viewer, const View& page,
                        const Eigen::Vector3d& center_mm) {
  RigidTransform level = in_mm(room_from_viewer);
  // Looking straight up or down is no heading: any will do.
  Eigen::Vector3d backward = level.rotation.col(2);
  backward.y() = 0;
  if (backward.norm() < 1e-3) backward = Eigen::Vector3d::UnitZ();
  backward.normalize();
  level.rotation << backward.z(), 0, backward.x(), 0, 1, 0, -backward.x(), 0, backward.z();
  RigidTransform eye_from_world{page.camera.camera_from_world.rotation};
  eye_from_world.translation = Eigen::Vector3d(0, 0, kAway_mm) - eye_from_world * center_mm;
  room_from_world_ = level * kTurnedOver * eye_from_world;
}

View HeadsetEyes::view(const Eigen::Matrix4d& eye_from_room, const Eigen::Matrix4d& projection,
                       const Eigen::Vector2i& size) const {
  View view;
  view.camera.camera_from_world = kTurnedOver * in_mm(eye_from_room) * room_from_world_;
  const double half_width = 0.5 * size.x(), half_height = 0.5 * size.y();
  Intrinsics& lens = view.camera.intrinsics;
  lens.width = size.x(), lens.height = size.y();
  lens.fx = half_width * projection(0, 0), lens.fy = half_height * projection(1, 1);
  lens.cx = half_width * (1 - projection(0, 2)), lens.cy = half_height * (1 + projection(1, 2));
  return view;
}

}  // namespace organbake
