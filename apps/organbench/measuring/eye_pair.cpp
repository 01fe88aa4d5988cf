// SPDX-License-Identifier: GPL-3.0-or-later
#include "measuring/eye_pair.h"

namespace organbake {
namespace {

constexpr double kThirtyDegrees_rad = 0.5235987755982988;  // tilted so, tissue is 40…100 mm away

}  // namespace

EyePair::EyePair(int width, int height, std::uint64_t seed)
    : EyePair(LaparoscopyPhantom({.seed = seed,
                                  .width = width,
                                  .height = height,
                                  .frames = 1,
                                  .texture = 0.3,
                                  .tilt_rad = kThirtyDegrees_rad,
                                  .baseline_mm = 4.5})) {}

EyePair::EyePair(const LaparoscopyPhantom& phantom)
    : left(phantom.frame(0)),
      right(phantom.right_frame(0)),
      rectifier({phantom.camera(0).intrinsics, phantom.right_camera(0).intrinsics,
                 phantom.right_camera(0).camera_from_world *
                     phantom.camera(0).camera_from_world.inverse()}) {}

StereoDepth EyePair::matched(Mask* tissue) const {
  const PreparedEyes ready = prepare_eyes(left.image, right.image, rectifier, {});
  if (tissue) *tissue = ready.left.tissue;
  return stereo_depth(ready.left, ready.right, rectifier.eyes(), {});
}

}  // namespace organbake
