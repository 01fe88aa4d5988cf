// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/image/channel_image.h"
#include "organbake/player/player.h"

namespace organbake {

// Pictures side by side on dark ground, `columns` a row, a thin gap between. All have one size.
Rgb8Image tile_pictures(const std::vector<Rgb8Image>& pictures, int columns, int gap_px);

// What an organ does at a glance: rest, three pokes of growing depth, three views all round (or
// from aside, where the cameras see one side only), and the deepest poke seen from aside. Pokes
// press where the organ faces camera 0, to a share of its size. seen: what to show of each frame;
// empty: its colours as they are.
using SeenFrame = std::function<Rgb8Image(const Frame& frame, const View& view)>;
Rgb8Image contact_sheet(Player& player, int tile_width, int tile_height,
                        const DrawOptions& drawing = {}, const RunContext& context = {},
                        const SeenFrame& seen = {});

// Presses one tip along the line from the organ's centre to camera 0 until it stands share ×
// the organ's thickness below the skin and the tissue has come to rest. Returns the tip.
Instrument hold_poke(Player& player, const Eigen::Vector3d& direction, double share,
                     double radius_mm);

}  // namespace organbake
