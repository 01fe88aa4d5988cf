// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "organbake/bundle/bundle.h"
#include "organbake/image/channel_image.h"
#include "organbake/player/carried_surface.h"
#include "organbake/warp/view.h"

namespace organbake {

// The best picture that the bundle's maps allow: at each pixel's centre the exact point of the
// carried surface, its colour read from the same cameras' maps by Catmull–Rom interpolation in
// linear light, blended as the warp blends. Where none of the view's cameras sees the point, any
// other that does; where none does, the truth's own colour. The ceiling for any warp of the maps.
// Every map must have been read.
Rgb8Image ideal_picture(const Bundle& bundle, const CarriedSurface& truth,
                        const std::vector<Eigen::Vector3d>& proxy_positions, const View& view,
                        const std::array<std::uint8_t, 3>& background);

}  // namespace organbake
