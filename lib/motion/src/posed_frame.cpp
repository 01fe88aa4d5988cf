// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/motion/posed_frame.h"

#include "organbake/shading/local_pattern.h"

namespace organbake {

PosedFrame posed_frame(const PreparedFrame& frame, const RigidTransform& camera_from_world) {
  return {{.name = {}, .intrinsics = frame.camera, .camera_from_world = camera_from_world},
          grey_levels(frame.color),
          frame.counts};
}

}  // namespace organbake
