// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

// Where the frames of a clip show tissue that features can lie on: inside the field of view, away
// from its rim, from highlights, from instruments and from what a recorder has laid over them. All
// of it is looked for at half size.
class UsablePixels {
 public:
  // What moves slowly is looked for in one of so many frames.
  // `insets`: of the frames' size (InsetFinder), or of none.
  explicit UsablePixels(std::size_t look_every = 5, const Mask& insets = {});
  // Of the next frame of the clip, in its size; non-zero = usable.
  Mask next(const Rgb8Image& frame);
  // Mean share of the frames so far that an instrument covers.
  double instrument_share() const { return looked_ ? instruments_sum_ / looked_ : 0; }
  // The share when they were last looked for, and whether all was as grey then as no tissue is.
  double instruments_now() const { return instruments_now_; }
  bool is_colourless_now() const { return colourless_; }

 private:
  void look_for_what_is_slow(const Rgb8Image& half);

  std::size_t look_every_, count_ = 0, looked_ = 0;
  double instruments_sum_ = 0, instruments_now_ = 0;
  bool colourless_ = false;
  Mask insets_, field_, slow_;  // at half size; no insets = of no size
};

}  // namespace organbake
