// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "drawing/base_drawing.h"
#include "drawing/open_pixels.h"
#include "drawing/resolve.h"
#include "drawing/splat.h"
#include "drawing/tile_plan.h"
#include "light/relit_skin.h"
#include "organbake/core/parallel.h"
#include "organbake/warp/draw_options.h"
#include "placing/active_cameras.h"

namespace organbake {

// What the tiles of one frame are drawn from, placed in its view and listed by tile.
struct PlacedFrame {
  const View& view;
  std::span<const ActiveCamera> cameras;
  float texel_mm;           // of the cameras
  const BaseDrawing* base;  // nullptr: without the base layer
  const PlacedFaces& faces;
  const RelitSkin* relit;                // nullptr: the light that was baked
  const std::vector<ShellMatrix>* rest;  // nullptr: what is shown is not told
  bool keep_bound;                       // tell where the skin of each pixel is bound
  bool smooth;                           // colours run on over texels' borders (SmoothDetail)
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
    OpenPixels open;
    BaseTile base;
    DrawTimes times, longest;  // of all its parts, and of the one that took the longest
    std::size_t base_triangles = 0;
    std::vector<std::uint64_t> cut_triangles;  // by tile and number, of other parts, too
  };
  void draw_part(const TilePart& part, SkinDepth& depth, Frame& frame);
  std::span<const std::uint32_t> base_blocks(int tile) const;
  bool is_empty(int tile) const;
  void splat(const ActiveCamera& camera, std::span<const std::uint32_t> chunks, float tie_mm,
             const PixelBox& part, TileKeys& keys, RowSpans& spans) const;
  const BaseTile* draw_base(std::span<const std::uint32_t> blocks, const TilePart& part,
                            std::span<const TileKeys* const> layers, Scratch& own) const;

  std::optional<PlacedFrame> placed_;
  TilePlan plan_;
  PerThread<Scratch> scratch_;
};

}  // namespace organbake
