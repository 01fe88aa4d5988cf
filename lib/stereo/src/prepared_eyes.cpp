// SPDX-License-Identifier: GPL-3.0-or-later
#include "organbake/stereo/prepared_eyes.h"

#include "instruments_by_depth.h"
#include "organbake/core/parallel.h"
#include "row_alignment.h"

namespace organbake {

PreparedEyes prepare_eyes(StoredPicture left, StoredPicture right, const Rectifier& rectifier,
                          const StereoOptions& options, bool masks) {
  const RectifiedEyes& eyes = rectifier.eyes();
  const DisparityRange range = disparity_range(eyes, options);
  const Intrinsics right_camera = eyes.right().intrinsics;
  StoredPicture a, b;
  parallel_both([&] { a = rectifier.left(std::move(left)); },
                [&] { b = rectifier.right(std::move(right)); });
  PreparedEyes ready;
  ready.corrected = find_row_alignment(a.color, b.color, right_camera, range);
  if (ready.corrected.needed()) b = StoredPicture(aligned(b.color, right_camera, ready.corrected));
  const FrameOptions prepare{.halvings = 0, .masks = masks, .piecewise_albedo = false};
  parallel_both([&] { ready.left = prepare_frame(a, eyes.camera, prepare); },
                [&] { ready.right = prepare_frame(b, right_camera, prepare); });
  keep_instruments_off_the_surface(range, ready.left, ready.right);
  return ready;
}

}  // namespace organbake
