// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "organbake/image/channel_image.h"

namespace organbake {

// How a stored picture is turned to stand upright: the eight values of Exif's orientation tag,
// named by what has to be done. 1 = nothing, 6 = a quarter turn clockwise.
enum class Turn {
  none = 1,
  mirror,
  half,
  flip,
  transpose,
  clockwise,
  transverse,
  counterclockwise
};

// Whether width and height change places.
inline bool swaps_sides(Turn turn) { return turn >= Turn::transpose; }

// A picture as a camera or a program stored it, with what its file says about its pixels.
struct StoredPicture {
  Rgb8Image color;  // 8-bit sRGB: to look at, and to find masks in
  // R, G, B of every pixel in linear light at any one gain, for what has more than 8 bits; empty:
  // `color` made linear is all there is.
  std::vector<float> linear;
  Turn turn = Turn::none;
  double pixel_aspect = 1;       // a pixel's width / its height, as it is stored
  double time_s = std::nan("");  // of a video's frame, when it is shown
  std::string name = {};         // of its file, without the ending; a video's frames have none

  StoredPicture() = default;
  StoredPicture(Rgb8Image image)
      : color(std::move(image)) {}  // NOLINT: an 8-bit picture is a picture
};

}  // namespace organbake
