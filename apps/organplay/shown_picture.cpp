// SPDX-License-Identifier: Apache-2.0
#include "shown_picture.h"

#include <utility>

#include "organbake/truth/truth_recorder.h"

namespace organbake {

ShownPicture::ShownPicture(Player& player, std::shared_ptr<const LensPicture> lens,
                           std::optional<double> eyes_mm)
    : player_(player), lens_(std::move(lens)), eyes_mm_(eyes_mm), organs_(rest_bounds(player)) {}

const Rgb8Image& ShownPicture::of(const Frame& frame, const View& view,
                                  const DrawOptions& options) {
  const Rgb8Image& left = through_lens(frame, view, left_);
  if (!eyes_mm_) return left;
  const View right = right_eye(view, *eyes_mm_);
  player_.draw(right, options, right_frame_);
  both_ = side_by_side(left, through_lens(right_frame_, right, right_));
  return both_;
}

const Rgb8Image& ShownPicture::through_lens(const Frame& frame, const View& view,
                                            Rgb8Image& seen) const {
  if (!lens_) return frame.color;
  lens_->show({frame, view, organs_}, seen);
  return seen;
}

}  // namespace organbake
