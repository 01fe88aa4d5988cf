// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "drawing/base_drawing.h"
#include "light/relit_skin.h"
#include "organbake/core/parallel.h"

namespace organbake {

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

// What the tiles of one frame are drawn from, placed in its view and listed by tile.
struct PlacedFrame {
  const View& view;
  std::span<const ActiveCamera> cameras;
  float texel_mm;  // of the cameras, on the surface
  const BaseDrawing& base;
  const PlacedFaces& faces;
  const RelitSkin* relit;       // nullptr: the light that was baked
  bool keep_bound;              // tell where the skin of each pixel is bound
  const CoarserOrgan* coarser;  // from which what is bound goes on to the whole one
  const Background background;
  bool measure;

  float tie_mm() const { return kTieTexels * texel_mm; }
  // Up to this far behind the nearest layer is one surface.
  float same_surface_mm() const { return 2 * texel_mm; }
};

// A tile's three pictures, ready to become one.
struct TileLayers {
  struct Layer {
    const SampleSet* set = nullptr;
    const TileKeys* keys = nullptr;
    float weight = 0;  // the camera's share in the view
  };
  const PlacedFrame& frame;
  std::array<Layer, 3> layers = {};
  int count = 0;                   // layers in use
  const BaseTile* base = nullptr;  // nullptr = nothing below; not lit yet
};

// Blends the layers per pixel in linear light and writes colour, cover and (when the frame keeps
// it) depth for the pixels of `box`. A layer counts by camera share × sample confidence, fading out
// between one and two same_surface_mm behind the nearest.
// Only the spans are looked at; the rest of the box becomes background.
// `depth` gets the depth of the skin of every pixel of the box.
void resolve_tile(const TileLayers& tile, const RowSpans& spans, const PixelBox& box,
                  SkinDepth& depth, Frame& frame);

// A part of a tile, which one thread draws.
struct TilePart {
  int tile = 0;
  PixelBox tile_box, box;
  double cost = 0;
};

// What moved of each tile, shared out so that no thread waits long for another: tiles that cost the
// most are split, and the dearest parts come first. What a pixel shows does not depend on the part
// that it lies in. items_of(tile): how many chunks and blocks are listed there, which a tile costs
// by.
std::vector<TilePart> shared_out(const TileGrid& grid, const DirtyCells& cells, int threads,
                                 const std::function<std::size_t(int tile)>& items_of);

// Draws tiles: each camera's samples, the base layer below them, and the blend. A part of a tile
// belongs to one thread; several are drawn at once.
class TileDrawing {
 public:
  // Those tiles, or parts of them, in which something moved; returns of how many. depth: see
  // resolve_tile().
  int draw(const PlacedFrame& placed, const TileGrid& grid, const DirtyCells& cells,
           SkinDepth& depth, Frame& frame);
  // Adds what that frame's tiles took; `all`: together with what it took to share them out.
  void count(const WorkSpan& all, DrawReport& report) const;

 private:
  // Kept between frames for its memory.
  struct Scratch {
    std::array<TileKeys, 3> keys;
    RowSpans spans;  // of all layers
    DrawnSamples samples;
    BaseTile base;
    DrawTimes times, longest;  // of all its parts, and of the one that took the longest
  };
  void draw_part(const PlacedFrame& placed, const TilePart& part, SkinDepth& depth, Frame& frame);

  PerThread<Scratch> scratch_;
};

}  // namespace organbake
