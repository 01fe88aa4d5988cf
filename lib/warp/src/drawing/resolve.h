// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "drawing/base_drawing.h"
#include "drawing/dominant_samples.h"
#include "drawing/tile_keys.h"
#include "light/relit_skin.h"
#include "organbake/geometry/shell_map.h"
#include "organbake/warp/frame.h"
#include "picture/row_spans.h"
#include "picture/skin_depth.h"

namespace organbake {

// A tile's three pictures, ready to become one.
struct TileLayers {
  struct Layer {
    const SampleSet* set = nullptr;
    const TileKeys* keys = nullptr;
    const RowSpans* spans = nullptr;  // where its samples may have placed
    float weight = 0;                 // the camera's share in the view
  };
  std::array<Layer, 3> layers;
  int count = 0;                   // layers in use
  const BaseTile* base = nullptr;  // nullptr = nothing below; not lit yet
  const RelitSkin* relit = nullptr;
  const std::vector<ShellMatrix>* rest = nullptr;  // when the frame keeps what is shown
  bool keep_bound = false;                         // fill the frame's bound pixels
  bool smooth = false;                             // by SampleSet::smooth
  float tie_mm = 0;                                // as splatted
  float same_surface_mm = 0;  // up to this far behind the nearest layer is one surface
  float texel_mm = 0;         // of the cameras, on the surface

  LayerShares shares() const {
    return {{layers[0].weight, layers[1].weight, layers[2].weight}, count};
  }
};

// A tile's row of background pixels.
class Background {
 public:
  explicit Background(const std::array<std::uint8_t, 3>& color);
  const std::array<std::uint8_t, 3>& color() const { return color_; }
  // Makes the box, within one tile, background in all planes of the frame, and shows no skin there.
  void fill(const PixelBox& box, SkinDepth& depth, Frame& frame) const;

 private:
  std::array<std::uint8_t, 3> color_;
  std::array<std::uint8_t, std::size_t{3} * TileGrid::kWidth> row_;
};

// Blends the layers per pixel in linear light and writes colour, cover and (when the frame keeps
// it) depth for the pixels of `box`. A layer counts by camera share × sample confidence, fading out
// between one and two same_surface_mm behind the nearest.
// Only the spans are looked at; the rest of the box becomes background.
// `depth` gets the depth of the skin of every pixel of the box.
void resolve_tile(const TileLayers& tile, const RowSpans& spans, const PixelBox& box,
                  const Background& background, SkinDepth& depth, Frame& frame);

}  // namespace organbake
