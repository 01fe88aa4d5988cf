// SPDX-License-Identifier: Apache-2.0
#include "organbake/warp/view.h"

#include <cmath>

#include "organbake/core/error.h"

namespace organbake {

void View::check() const {
  const Intrinsics& k = camera.intrinsics;
  if (k.width < 1 || k.height < 1 || k.width > kLargestSide_px || k.height > kLargestSide_px) {
    throw UsageError("view of " + std::to_string(k.width) + " × " + std::to_string(k.height) +
                     " pixels: each side needs 1…16384");
  }
  if (k.has_distortion()) throw UsageError("a view is drawn without lens distortion");
  if (!(k.fx > 0 && k.fy > 0) || !std::isfinite(k.fx + k.fy + k.cx + k.cy)) {
    throw UsageError("view: focal lengths need to be positive, the principal point finite");
  }
  if (!camera.camera_from_world.rotation.allFinite() ||
      !camera.camera_from_world.translation.allFinite()) {
    throw UsageError("view: the pose is not finite");
  }
  if (!(near_mm > 0) || !std::isfinite(near_mm)) {
    throw UsageError("view: the near plane needs a positive distance in mm");
  }
}

bool operator==(const View& a, const View& b) {
  const Intrinsics &i = a.camera.intrinsics, &j = b.camera.intrinsics;
  return i.width == j.width && i.height == j.height && i.fx == j.fx && i.fy == j.fy &&
         i.cx == j.cx && i.cy == j.cy && a.near_mm == b.near_mm &&
         a.camera.camera_from_world.rotation == b.camera.camera_from_world.rotation &&
         a.camera.camera_from_world.translation == b.camera.camera_from_world.translation;
}

}  // namespace organbake
