// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "organbake/image/channel_image.h"

namespace organbake {

enum class ChromaSampling { full, halved };  // 4:4:4, 4:2:0

// The picture as a JPEG of this quality (1…100) gives it back.
Rgb8Image through_jpeg(const Rgb8Image& image, int quality, ChromaSampling chroma);

}  // namespace organbake
