// SPDX-License-Identifier: GPL-3.0-or-later
#include "posed_frame.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "organbake/geometry/camera.h"
#include "organbake/shading/cv_grid.h"
#include "organbake/shading/frame_preparation.h"
#include "organbake/shading/local_pattern.h"
#include "organbake/shading/masks.h"
#include "organbake/shading/prepared_frame.h"
#include "organbake/shading/undistort.h"

namespace organbake {
namespace {

Mask of_size(const Mask& mask, int width, int height) {
  Mask reduced(width, height);
  cv::Mat target = cv_view(reduced);
  cv::resize(cv_view(mask), target, target.size(), 0, 0, cv::INTER_NEAREST);
  return reduced;
}

}  // namespace

PosedFrame posed_frame(const ClipPicture& frame, const Intrinsics& lens, int halvings,
                       const RigidTransform& camera_from_world) {
  StoredPicture picture = frame.picture;
  if (is_combed(picture.color)) deinterlace(picture);
  Intrinsics small = lens;
  for (int i = 0; i < halvings; ++i) {
    picture.color = half_size(picture.color);
    small = half_size(small);
  }
  PosedFrame posed{{"", pinhole_of(small), camera_from_world}, {}, {}};
  // The glow round a highlight moves with it, and would be matched behind the surface.
  constexpr int kGlow = 213;  // of the width one such part
  posed.counts =
      eroded(of_size(frame.usable, small.width, small.height), std::max(1, small.width / kGlow));
  if (small.has_distortion()) {
    picture.color = undistorted(picture.color, small, posed.camera.intrinsics);
    posed.counts = undistorted(posed.counts, small, posed.camera.intrinsics);
  }
  posed.intensity = grey_levels(picture.color);
  return posed;
}

}  // namespace organbake
