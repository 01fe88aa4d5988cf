// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "drawing/splat.h"
#include "organbake/bundle/base_layer.h"
#include "organbake/geometry/shell.h"
#include "organbake/geometry/view_manifold.h"
#include "organbake/warp/rasteriser.h"

namespace organbake {

// What the cameras' samples leave of a tile to the base layer: pixels that none placed on, and what
// lies before the farthest of them, which is looked for cell by cell when it is asked for.
class DrawnSamples {
 public:
  void begin(const PixelBox& tile, std::span<const TileKeys* const> layers);

  bool open(int x, int y) const;  // of the picture
  // Nothing that a pixel of the box, clipped to the tile, shows lies farther; +inf: one is open.
  float farthest_mm(const PixelBox& box);

 private:
  static constexpr int kCell = 16;  // pixels a side
  static constexpr int kColumns = TileGrid::kWidth / kCell, kRows = TileGrid::kHeight / kCell;
  static constexpr float kUnknown = -1;
  float look(const PixelBox& cell) const;

  PixelBox tile_;
  std::span<const TileKeys* const> layers_;
  std::array<float, std::size_t{kColumns} * kRows> farthest_mm_;
};

// The base layer's weight where no active camera sees the skin; samples weigh camera × confidence.
inline constexpr float kBaseWeight = 0.03f;
// Of the cameras' shares in the view: from there on the base layer has no weight where they see.
inline constexpr double kSeenEnough = 0.05;

// One tile's picture of the base layer; depth +inf where it is not drawn.
struct BaseTile {
  using Shade = Eigen::Vector4f;  // red, green, blue, linear; weight
  struct BoundPoint {
    std::uint32_t face;
    float b1, b2, height_mm;
  };

  PixelBox box;
  bool any_drawn = false;  // of the triangles
  RowSpans spans;          // where triangles may lie
  std::vector<float> depth;
  // What lies side by side is written and read together: pixels are few, and strewn about.
  std::vector<Shade> shade;
  std::vector<BoundPoint> bound;  // over the proxy; only when they are kept

  void clear(const PixelBox& tile, bool keep_bound);
  bool drawn(std::size_t at) const { return depth[at] < std::numeric_limits<float>::infinity(); }
  std::size_t at(int x, int y) const {
    return std::size_t(y - box.y0) * box.width() + (x - box.x0);
  }
};

// Draws the parts of the base layer that a view needs: where it weighs because the active cameras
// hardly see the skin, all of faces that are seen from near, and, on those between whose samples
// gaps may open, the pixels that no sample reached. Whole blocks of a face's lattice are passed
// over before any of their nodes is placed.
class BaseDrawing {
 public:
  // rest: the proxy's shell matrices, undeformed, world.
  BaseDrawing(const BaseLayer& layer, const std::vector<ShellMatrix>& rest);

  bool empty() const { return blocks_.empty(); }
  const BaseLayer& layer() const { return layer_; }
  // Chooses the blocks of one frame, by the report's weights, and lists them by tile. cut: by
  // blades, so that gaps may open on any face. Marks the pixels of moved faces' blocks, where they
  // were and where they are; adds all blocks to what is visible, their triangles to the report.
  void place(const PlacedFaces& faces, bool cut, const View& view, const TileGrid& grid,
             DirtyCells& cells, VisibilitySummary& visibility, DrawReport& report);
  // A tile's chosen blocks by number.
  std::span<const std::uint32_t> blocks_of(int tile) const { return tiles_[tile]; }

  // Draws a chosen block into a tile, unless all of it lies more than behind_mm behind samples.
  // Thread-safe.
  void draw(std::uint32_t chosen, const PlacedFaces& faces, const View& view, float behind_mm,
            DrawnSamples& samples, BaseTile& tile) const;

 private:
  // Lattice cells (i, j) of a face, kCells a side: quads of two triangles.
  static constexpr std::uint32_t kCells = 4;
  struct Block {
    Patch patch;
    std::uint32_t i = 0, j = 0;  // first cell
    std::size_t triangles = 0;
    std::vector<std::uint32_t> seen_by;  // of its nodes, each set of cameras once
  };
  struct Chosen {
    std::uint32_t block, face;
    PixelBox box;
    bool weighs, fills_gaps, everywhere;
  };
  struct PlacedBlock;

  Block make_block(std::uint32_t face, std::uint32_t i, std::uint32_t j,
                   const ShellMatrix& rest) const;
  std::size_t node(std::uint32_t face, std::uint32_t i, std::uint32_t j) const {
    return std::size_t(face) * layer_.nodes_per_face() + base_node_index(layer_.steps, i, j);
  }
  std::uint32_t block_end(std::uint32_t first) const {  // last node row of a block
    return std::min(first + kCells, layer_.steps);
  }
  float weight_of(std::uint32_t seen_by) const;
  void choose(const PlacedFaces& faces, bool cut, const View& view);
  void mark_moved(const PlacedFaces& faces, DirtyCells& cells) const;

  BaseLayer layer_;
  std::vector<Block> blocks_;  // by face
  // By block: where it lies in this view, and whether that is known, by the first of each batch.
  std::vector<ChunkFrame> placed_;
  std::vector<std::uint8_t> is_placed_;
  PatchTable patches_;  // theirs, once more
  std::vector<Chosen> chosen_;
  TileLists tiles_;                             // of them
  std::array<std::uint32_t, 3> active_ = {};    // the frame's cameras
  std::array<float, 8> weight_by_active_ = {};  // by which of the three see a node, in bits
};

}  // namespace organbake
