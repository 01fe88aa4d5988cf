// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "organbake/warp/pixel_box.h"

namespace organbake {

// A sample stands for pixels up to this many texels away along each map axis. Half a texel reaches
// the neighbour; the rest forgives a patch's plane for not being its surface. More would thicken
// silhouettes, which costs more than all that happens inside them: at 0.75 texels, or with half a
// pixel where texels are smaller than that, 5 dB over the union of both silhouettes.
inline constexpr float kReach = 0.65f;

enum class ChunkVisibility : std::uint8_t { drawn, faces_away, outside_view };

// One chunk in one frame. Offsets from a sample to a pixel's centre are shares of the sample's
// reach (kReach), so that −1…1 is what a sample stands for.
struct ChunkFrame {
  float u_x, u_y, v_x, v_y;  // offset per pixel
  float z_u, z_v;            // depth per offset
  int columns, rows;         // pixels to try per sample, ≥ 1
  PixelBox box;              // of all pixels it may touch, clipped to the view
  ChunkVisibility visibility;
  bool uncut;  // neither the view's border nor its near plane cuts it

  bool operator==(const ChunkFrame&) const = default;
};

// A texel is drawn over at most this many pixels along each axis; nearer still, the base layer
// shows between the samples.
inline constexpr int kMostSplat = 64;

// Pixels of a texel along its longest side from which on its face counts as seen from near.
inline constexpr int kNearSplat = 12;

}  // namespace organbake
