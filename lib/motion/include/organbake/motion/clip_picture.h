// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>
#include <vector>

#include "organbake/image/picture.h"
#include "organbake/shading/grid.h"

namespace organbake {

// A frame of a clip, and where tissue is to be seen in it (UsablePixels; of the frame's size).
struct ClipPicture {
  StoredPicture picture;
  Mask usable;
};

// The pictures of these frames of the clip, in their order. They stay where they are.
using PictureLoader =
    std::function<std::vector<const ClipPicture*>(const std::vector<std::size_t>& frames)>;

}  // namespace organbake
