// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "drawing/base_drawing.h"
#include "drawing/splat.h"
#include "light/relit_skin.h"
#include "organbake/core/parallel.h"
#include "organbake/geometry/shell.h"
#include "organbake/warp/draw_options.h"
#include "organbake/warp/frame.h"
#include "picture/spans.h"
#include "picture/tiles.h"
#include "placing/placing.h"

namespace organbake {

// A span of one layer's row, decoded from its keys.
struct LayerSpan {
  alignas(64) float depth[kSpan], u[kSpan], v[kSpan];
  alignas(64) std::int32_t slot[kSpan];
};
using LayerSpans = std::array<LayerSpan, 3>;

// The cameras' shares in the view, by layer.
struct LayerShares {
  std::array<float, 3> of;
  int count;  // layers in use
};

// The sample that speaks for each pixel: of the camera with the largest share of those that see the
// nearest skin (up to tolerance_mm behind it). The nearest sample itself may be of a camera that
// hardly counts there.
struct DominantSamples {
  alignas(64) std::int32_t layer[kSpan];

  DominantSamples(const LayerShares& shares, const LayerSpans& rows, const SumSpan& sum,
                  float tolerance_mm, int count);
};

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
  bool keep_bound = false;                // fill the frame's bound pixels
  const CoarserOrgan* coarser = nullptr;  // what is bound goes on from it to the whole one
  float tie_mm = 0;                       // as splatted
  float same_surface_mm = 0;              // up to this far behind the nearest layer is one surface
  float texel_mm = 0;                     // of the cameras, on the surface

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
std::vector<TilePart> shared_out(const TileGrid& grid, DirtyCells& cells, int threads,
                                 const std::function<std::size_t(int tile)>& items_of);

// What the tiles of one frame are drawn from, placed in its view and listed by tile.
struct PlacedFrame {
  const View& view;
  std::span<const ActiveCamera> cameras;
  float texel_mm;  // of the cameras
  const BaseDrawing& base;
  const PlacedFaces& faces;
  const RelitSkin* relit;       // nullptr: the light that was baked
  bool keep_bound;              // tell where the skin of each pixel is bound
  const CoarserOrgan* coarser;  // from which what is bound goes on to the whole one
  const Background& background;
  bool measure;
};

// Draws tiles: each camera's samples, the base layer below them, and the blend. A part of a tile
// belongs to one thread; several are drawn at once.
class TileDrawing {
 public:
  // What `placed` refers to must last until the frame's last tile.
  void begin(const PlacedFrame& placed);
  // Those tiles, or parts of them, in which something moved; returns of how many. depth: see
  // resolve_tile().
  int draw(const TileGrid& grid, DirtyCells& cells, SkinDepth& depth, Frame& frame);
  // Adds what the frame's tiles took; `all`: together with what it took to share them out.
  void count(const WorkSpan& all, DrawReport& report) const;

 private:
  // Kept between frames for its memory.
  struct Scratch {
    std::array<TileKeys, 3> keys;
    std::array<RowSpans, 3> layer_spans;
    RowSpans spans;  // of all layers
    DrawnSamples samples;
    BaseTile base;
    DrawTimes times, longest;  // of all its parts, and of the one that took the longest
  };
  void draw_part(const TilePart& part, SkinDepth& depth, Frame& frame);
  bool is_empty(int tile) const;
  void splat(const ActiveCamera& camera, std::span<const std::uint32_t> chunks, float tie_mm,
             const PixelBox& part, TileKeys& keys, RowSpans& spans) const;
  const BaseTile* draw_base(const TilePart& part, std::span<const TileKeys* const> layers,
                            float behind_mm, Scratch& own) const;

  std::optional<PlacedFrame> placed_;
  PerThread<Scratch> scratch_;
};

}  // namespace organbake
