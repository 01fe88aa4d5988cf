// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "organbake/geometry/rigid_transform.h"
#include "organbake/warp/view.h"

namespace organbake {

// Where an organ stands in the room of a headset, whose frames are WebXR's: metres, y up, the eyes
// look along −z.
class HeadsetEyes {
 public:
  // The organ as `page` sees it, upright half a metre before whoever wears the headset.
  void place(const Eigen::Matrix4d& room_from_viewer, const View& page,
             const Eigen::Vector3d& center_mm);
  // Of one eye, of a picture of `size` pixels; projection: of any frustum.
  View view(const Eigen::Matrix4d& eye_from_room, const Eigen::Matrix4d& projection,
            const Eigen::Vector2i& size) const;

 private:
  RigidTransform room_from_world_;  // mm
};

}  // namespace organbake
