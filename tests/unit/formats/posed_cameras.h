// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/bundle/cameras_json.h"
#include "support/testing.h"

namespace organbake {

// Two cameras that differ in everything, one of them with distortion.
inline CameraSet two_cameras() {
  CameraSet set;
  for (int c = 0; c < 2; ++c) {
    PosedCamera camera;
    camera.name = "cam_00" + std::to_string(c);
    camera.intrinsics = {640, 480 + c, 500.25 + c, 510.5, 320.125, 239.75};
    if (c == 1) camera.intrinsics.k1 = -0.1, camera.intrinsics.p2 = 0.002;
    camera.camera_from_world.rotation =
        Eigen::AngleAxisd(0.4 + c, Eigen::Vector3d(1, 2 - c, -0.5).normalized()).toRotationMatrix();
    camera.camera_from_world.translation = {10.5 - c, -20.25, 300};
    set.cameras.push_back(camera);
    set.images.push_back(camera.name + ".png");
  }
  return set;
}

}  // namespace organbake
