// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "image/picture.h"

namespace organbake {

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
