// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/geometry/camera.h"
#include "organbake/shading/frame.h"
#include "organbake/shading/grid.h"

namespace organbake {

// A frame of a clip, of the size at which it is matched. Lengths are in the unit of the poses:
// millimetres, or whatever a reconstruction of unknown scale has.
struct PosedFrame {
  PosedCamera camera;  // without distortion, which is undone in the picture
  Plane intensity;     // grey levels as coded in sRGB, 0…255: noise is alike in dark and bright
  Mask counts;         // tissue that is neither highlight nor instrument
};

// Of a frame that prepare_frame undistorted and masked.
PosedFrame posed_frame(const PreparedFrame& frame, const RigidTransform& camera_from_world);

}  // namespace organbake
