// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "organbake/image/channel_image.h"
#include "organbake/shading/grid.h"

namespace organbake {

// Finds what a recorder has laid into the frames of a clip, which is no tissue: a second picture,
// still (an ultrasound image) or live (another camera), bars of text, logos, frozen panels. A clip
// that does not move tells none, nor does one of fewer than kFewest frames. Looks at some frames
// spread over the clip, so that its memory does not grow with it; deterministic.
class InsetFinder {
 public:
  static constexpr std::size_t kFewest = 4;

  // The next frame of the clip, of any one size.
  void add(const Rgb8Image& frame);
  // Of the frames' size, non-zero = an inset; of no size where there is none.
  Mask find() const;

 private:
  std::vector<Rgb8Image> samples_;  // halved to at most 960 pixels
  std::size_t count_ = 0, stride_ = 1;
  int width_ = 0, height_ = 0;
};

// The share of the pixels that are non-zero; 0 of no pixels.
double share_of(const Mask& mask);

// What to say of insets that cover this share of the frames.
std::string told_of_insets(double share);

}  // namespace organbake
