// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "image/picture.h"

namespace organbake {

// Whether neighbouring rows differ far more than rows of one field do: motion between two fields.
bool is_combed(const Rgb8Image& frame);
// Keeps the upper field and interpolates the lower.
void deinterlace(StoredPicture& frame);

}  // namespace organbake
