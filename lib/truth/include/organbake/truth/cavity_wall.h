// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "organbake/geometry/triangle_mesh.h"
#include "organbake/image/channel_image.h"
#include "organbake/player/player.h"
#include "organbake/warp/frame.h"
#include "organbake/warp/view.h"

namespace organbake {

// A drawn frame, from where it was drawn, and the box of the organs at rest, world mm.
struct DrawnScene {
  const Frame& frame;
  const View& view;
  Bounds organs;
};

Bounds rest_bounds(const Player& player);

// Paints what lies behind the organs in an operation: the wall of a cavity, a sphere about the
// organs that stays where it is when the view moves, dim, red-brown and folded, with fat here and
// there, lit by the light at the scope as its range asks. Only pixels of Cover::background that
// have the colour `behind` change, in `picture`, a copy of the frame's: frames and truth never
// show it. The same scene gives the same bytes.
void paint_cavity_wall(const DrawnScene& scene, const std::array<std::uint8_t, 3>& behind,
                       Rgb8Image& picture);

}  // namespace organbake
