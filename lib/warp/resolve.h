// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "warp/base_drawing.h"
#include "warp/frame.h"
#include "warp/splat.h"

namespace organbake {

// A tile's three pictures, ready to become one.
struct TileLayers {
  struct Layer {
    const SampleSet* set = nullptr;
    const TileKeys* keys = nullptr;
    float weight = 0;  // the camera's share in the view
  };
  std::array<Layer, 3> layers;
  int count = 0;                   // layers in use
  const BaseTile* base = nullptr;  // nullptr or not drawn = nothing below
  float tie_mm = 0;                // as splatted
  float same_surface_mm = 0;       // up to this far behind the nearest layer is one surface
};

struct ResolveCounts {
  std::size_t sample_pixels = 0, base_pixels = 0;
};

// Blends the layers per pixel in linear light and writes colour, cover and (when the frame keeps
// it) depth for the pixels of `box`. A layer counts by camera share × sample confidence, fading out
// between one and two same_surface_mm behind the nearest.
ResolveCounts resolve_tile(const TileLayers& tile, const PixelBox& box,
                           const std::array<std::uint8_t, 3>& background, Frame& frame);

void fill_background(const PixelBox& box, const std::array<std::uint8_t, 3>& background,
                     Frame& frame);

}  // namespace organbake
