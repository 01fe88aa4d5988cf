// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "organbake/warp/pixel_box.h"
#include "picture/skin_depth.h"

namespace organbake {

// Between two terraces of a CT's slices, seen more from the side than any camera saw them, single
// pixels look through the skin at whatever lies behind. A covered pixel that lies deeper_mm behind
// the nearer of two pixels on either side, along its row or its column, is one: made background,
// the slits' and holes' filling closes it. `depth` is looked at in the box and round it. Returns
// the pixels' numbers in the picture, ascending.
std::vector<std::uint32_t> find_see_through(const PixelBox& box, const SkinDepth& depth,
                                            float deeper_mm);

}  // namespace organbake
