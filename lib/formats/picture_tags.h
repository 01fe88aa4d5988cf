// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <span>

#include "image/picture.h"

namespace organbake {

// What a picture file says about its pixels besides their values.
struct PictureTags {
  Turn turn = Turn::none;
  double pixel_aspect = 1;  // a pixel's width / its height
};

// Exif's orientation (Exif 2.32, tag 0x0112) and the pixels' aspect of a JPEG (JFIF's densities) or
// a PNG (pHYs). Tags that are absent, damaged or senseless are not there; never throws.
PictureTags jpeg_tags(std::span<const std::byte> file);
PictureTags png_tags(std::span<const std::byte> file);

}  // namespace organbake
