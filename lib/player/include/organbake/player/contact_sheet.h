// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "organbake/core/run_context.h"
#include "organbake/image/channel_image.h"
#include "organbake/player/orbit.h"
#include "organbake/player/player.h"
#include "organbake/player/skin_point.h"

namespace organbake {

// Pictures side by side on dark ground, `columns` a row, a thin gap between. All have one size.
Rgb8Image tile_pictures(const std::vector<Rgb8Image>& pictures, int columns, int gap_px);

// What an organ does at a glance: rest, three pokes of growing depth from near, three views all
// round, and a poke from another side. Pokes press where their view sees them (poke_site), to a
// share of the thickness there; below each stand its depth and the force on the tip. Where the
// cameras see one side only, no view leads farther to the sides than they do, and that is written
// below.
// seen: what to show of each frame; empty: its colours as they are.
using SeenFrame = std::function<Rgb8Image(const Frame& frame, const View& view)>;
Rgb8Image contact_sheet(Player& player, int tile_width, int tile_height,
                        const DrawOptions& drawing = {}, const RunContext& context = {},
                        const SeenFrame& seen = {});

// Presses a tip at a site, straight in, until it stands a depth below where the skin lay and the
// tissue has come to rest.
struct HeldPoke {
  Instrument tip;
  double depth_mm = 0, force_n = 0;
};
HeldPoke hold_poke(Player& player, const PokeSite& site, double depth_mm, double radius_mm);

// A view's pose from near, with a place at rest in its middle.
OrbitPose close_up(const CameraSet& cameras, OrbitPose pose, const Eigen::Vector3d& place_mm);

// Presses one tip along the line from the organ's centre to camera 0 until it stands share ×
// the organ's thickness below the skin and the tissue has come to rest. Returns the tip.
Instrument hold_poke(Player& player, const Eigen::Vector3d& direction, double share,
                     double radius_mm);

}  // namespace organbake
