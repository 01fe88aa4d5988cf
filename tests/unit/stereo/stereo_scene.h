// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/phantom/laparoscopy.h"
#include "organbake/stereo/stereo_depth.h"
#include "support/testing.h"

namespace organbake {

// A stereo laparoscope's view at 30° onto the bed: 40…100 mm away, textured, moist, an instrument.
inline LaparoscopyOptions stereo_scene(int width, int height, std::uint64_t seed = 1) {
  return {.seed = seed,
          .width = width,
          .height = height,
          .frames = 1,
          .texture = 0.3,
          .tilt_rad = 0.5235987755982988,
          .baseline_mm = 4.5};
}

inline StereoRig rig_of(const LaparoscopyPhantom& phantom) {
  const PosedCamera left = phantom.camera(0), right = phantom.right_camera(0);
  return {left.intrinsics, right.intrinsics,
          right.camera_from_world * left.camera_from_world.inverse()};
}

inline StereoDepth depth_of_pair(const Rectifier& rectifier, const Rgb8Image& left,
                                 const Rgb8Image& right, PreparedFrame* prepared = nullptr) {
  const PreparedEyes ready = prepare_eyes(left, right, rectifier, {});
  if (prepared) *prepared = ready.left;
  return stereo_depth(ready.left, ready.right, rectifier.eyes(), {});
}

struct DepthErrors {
  double mean = 0, bad = 0;  // shares: relative error, pixels off by more than 3 %
  double dense = 0;          // share of the tissue that has a depth
  double nearest_mm = 1e9, farthest_mm = 0;
};

inline DepthErrors errors_of(const Plane& depth, const Plane& truth_mm, const Mask& tissue) {
  DepthErrors errors;
  double count = 0, all = 0;
  for (std::size_t k = 0; k < depth.size(); ++k) {
    const double truth = truth_mm.values[k];
    if (!tissue.values[k] || !std::isfinite(truth)) continue;
    ++all;
    errors.nearest_mm = std::min(errors.nearest_mm, truth);
    errors.farthest_mm = std::max(errors.farthest_mm, truth);
    if (!std::isfinite(depth.values[k])) continue;
    const double relative = std::abs(depth.values[k] / truth - 1);
    errors.mean += relative;
    errors.bad += relative > 0.03;
    ++count;
  }
  errors.mean /= std::max(1.0, count);
  errors.bad /= std::max(1.0, count);
  errors.dense = count / std::max(1.0, all);
  return errors;
}

}  // namespace organbake
