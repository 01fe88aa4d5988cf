// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <memory>

#include "organbake/image/picture.h"
#include "organbake/stereo/stereo_rig.h"

namespace organbake {

// Two like cameras side by side, whose rows are the same rows: a point in column x of the left
// picture lies in column x − disparity of the right one, and
//   depth = fx · baseline / (disparity − disparity_at_infinity).
struct RectifiedEyes {
  Intrinsics camera;  // of the left picture; without distortion
  double baseline_mm = 0;
  double disparity_at_infinity = 0;    // px: 0 for like principal points
  RigidTransform rectified_from_left;  // a rotation: how the left camera was turned
  // The right picture's camera, in the left rectified one's axes.
  PosedCamera right() const;
};

// Turns the pictures of a rig so (cv::stereoRectify). Pictures that stand so already stay as they
// are, pixel for pixel.
class Rectifier {
 public:
  // Throws BadDataError for a rig that cannot be rectified.
  explicit Rectifier(const StereoRig& rig);
  ~Rectifier();
  Rectifier(Rectifier&&) noexcept;

  const RectifiedEyes& eyes() const;
  bool changes_pictures() const;
  // Black where a picture shows nothing. 8 bits are all that is kept.
  StoredPicture left(StoredPicture picture) const;
  StoredPicture right(StoredPicture picture) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace organbake
