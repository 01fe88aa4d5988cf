// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/geometry/camera.h"
#include "organbake/motion/clip_picture.h"
#include "organbake/shading/grid.h"

namespace organbake {

// A frame of a clip, of the size at which it is matched. Lengths are in the unit of the poses:
// millimetres, or whatever a reconstruction of unknown scale has.
struct PosedFrame {
  PosedCamera camera;  // without distortion, which is undone in the picture
  Plane intensity;     // grey levels as coded in sRGB, 0…255: noise is alike in dark and bright
  Mask counts;         // tissue that is neither highlight nor instrument
};

// `lens` is of the whole picture, whose size is halved this often.
PosedFrame posed_frame(const ClipPicture& frame, const Intrinsics& lens, int halvings,
                       const RigidTransform& camera_from_world);

}  // namespace organbake
