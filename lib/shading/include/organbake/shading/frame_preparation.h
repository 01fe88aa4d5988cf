// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <vector>

#include "organbake/image/channel_image.h"
#include "organbake/image/picture.h"

namespace organbake {

// Whether neighbouring rows differ far more than rows of one field do: motion between two fields.
bool is_combed(const Rgb8Image& frame);
// Keeps the upper field and interpolates the lower.
void deinterlace(StoredPicture& frame);

// Mean squared Laplacian of the green channel: falls when a frame is blurred by motion.
double sharpness(const Rgb8Image& frame);
// The side of the squares of one colour that a frame is made of: a mosaic, or a small picture that
// was enlarged by repeating its pixels; 1 of others. Up to 32.
int squares_px(const Rgb8Image& frame);
// Mean of the green channel, 0…255.
double brightness(const Rgb8Image& frame);
// Whether the brightness of a clip's frames jumps to and fro, as under a stroboscope: most frames
// differ from the one before by far more than any exposure that follows the tissue.
bool flickers(const std::vector<double>& brightness);
// Mean absolute difference of two frames' green channels (0…255); infinite when sizes differ.
double mean_difference(const Rgb8Image& a, const Rgb8Image& b);

// The size that upright() gives.
struct PixelSize {
  int width = 0, height = 0;
  bool operator==(const PixelSize&) const = default;
};
PixelSize upright_size(const StoredPicture& picture);

// The picture with square pixels (the shorter side of a pixel is divided, so that nothing is lost)
// and turned as its file asks. Throws BadDataError for an aspect that no camera has.
void make_upright(StoredPicture& picture);

}  // namespace organbake
