// SPDX-License-Identifier: Apache-2.0
// A frame's tiles: shared out among threads by what they cost, then splatted, filled from the base
// layer and resolved.
#include "drawing/tile_drawing.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace organbake {
void DrawnSamples::begin(const PixelBox& tile, std::span<const TileKeys* const> layers) {
  tile_ = tile, layers_ = layers;
  farthest_mm_.fill(kUnknown);
}

bool DrawnSamples::open(int x, int y) const {
  return std::all_of(layers_.begin(), layers_.end(), [&](const TileKeys* layer) {
    return layer->row(y)[x - tile_.x0] == kEmptyKey;
  });
}

float DrawnSamples::look(const PixelBox& cell) const {
  std::uint32_t farthest = 0;
  for (int y = cell.y0; y < cell.y1; ++y) {
    std::array<std::uint32_t, kCell> nearest;
    nearest.fill(kEmptyHigh);
    // Whole rows of a cell: the guard band is there to be read.
    for (const TileKeys* layer : layers_) {
      const std::uint64_t* const keys = layer->row(y) + (cell.x0 - tile_.x0);
      for (int i = 0; i < kCell; ++i)
        nearest[i] = std::min(nearest[i], static_cast<std::uint32_t>(keys[i] >> 32));
    }
    for (int i = 0; i < cell.width(); ++i) farthest = std::max(farthest, nearest[i]);
  }
  return depth_of(farthest);
}

float DrawnSamples::farthest_mm(const PixelBox& box) {
  const PixelBox part = intersected(box, tile_);
  const PixelBox in_tile = {part.x0 - tile_.x0, part.y0 - tile_.y0, part.x1 - tile_.x0,
                            part.y1 - tile_.y0};
  float farthest = 0;
  each_block(in_tile, kCell, kCell, [&](int column, int row) {
    float& of_cell = farthest_mm_[std::size_t(row) * kColumns + column];
    const int x = tile_.x0 + kCell * column, y = tile_.y0 + kCell * row;
    if (of_cell == kUnknown) of_cell = look(intersected({x, y, x + kCell, y + kCell}, tile_));
    farthest = std::max(farthest, of_cell);
  });
  return farthest;
}

namespace {

// So many parts for each thread leave none idle for long at the end; more would place too many
// samples twice, for both of the parts that their chunk touches.
constexpr int kPartsPerThread = 2;
// Cuts lie where groups of pixels end that are lit together, and parts are no narrower.
constexpr int kCut_px = 2 * DirtyCells::kCell_px;

double share(const PixelBox& box, const PixelBox& of) {
  return double(box.width()) * box.height() / (double(of.width()) * of.height());
}

// The k-th of `pieces` cuts from `first` on to `last`.
int cut(int first, int last, int k, int pieces) {
  return k == pieces ? last : first + (last - first) * k / pieces / kCut_px * kCut_px;
}

// Into up to six parts: across first, as a tile is wide.
void split(const TilePart& whole, int pieces, std::vector<TilePart>& parts) {
  const int rows = pieces >= 4 ? 2 : 1;
  const int columns = std::clamp((pieces + rows - 1) / rows, 1, 3);
  const PixelBox& all = whole.box;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      TilePart part = whole;
      part.box = {cut(all.x0, all.x1, column, columns), cut(all.y0, all.y1, row, rows),
                  cut(all.x0, all.x1, column + 1, columns), cut(all.y0, all.y1, row + 1, rows)};
      if (part.box.empty()) continue;
      part.cost *= share(part.box, all);
      parts.push_back(part);
    }
  }
}

// A camera's chunks into one part of a tile.
void splat(const PlacedFrame& placed, const ActiveCamera& camera,
           std::span<const std::uint32_t> chunks, const PixelBox& part, TileKeys& keys) {
  constexpr std::size_t kAhead = 2, kFarAhead = 8;  // chunks that are sent for
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    if (i + kFarAhead < chunks.size()) {
      __builtin_prefetch(&camera.chunks[chunks[i + kFarAhead]]);
      __builtin_prefetch(&camera.set->chunks[chunks[i + kFarAhead]]);
    }
    const auto touches = [&](std::size_t at) {
      return !intersected(camera.chunks[chunks[at]].box, part).empty();
    };
    if (i + kAhead < chunks.size() && touches(i + kAhead))
      prefetch_chunk(*camera.set, chunks[i + kAhead]);
    if (!touches(i)) continue;
    const std::uint32_t c = chunks[i], face = camera.set->chunks[c].patch.face;
    const ChunkFrame& chunk = camera.chunks[c];
    if (placed.relit) placed.relit->prefetch(face);
    // Texels larger than a splat may be would be squares in a lattice; the base layer is smooth.
    if (!placed.base.empty() && std::max(chunk.columns, chunk.rows) >= kMostSplat) continue;
    keys.spans.add(chunk.box);
    splat_chunk(*camera.set, c, chunk, placed.faces[face], static_cast<float>(placed.view.near_mm),
                placed.tie_mm(), keys);
  }
}

}  // namespace

std::vector<TilePart> shared_out(const TileGrid& grid, const DirtyCells& cells, int threads,
                                 const std::function<std::size_t(int)>& items_of) {
  std::vector<TilePart> tiles, parts;
  double sum = 0;
  for (int t = 0; t < grid.count(); ++t) {
    const PixelBox tile_box = grid.box(t), drawn = cells.within(tile_box);
    if (drawn.empty()) continue;
    const double cost = static_cast<double>(items_of(t)) * share(drawn, tile_box);
    tiles.push_back({t, tile_box, drawn, cost});
    sum += cost;
  }
  if (threads == 1) return tiles;
  const double most = std::max(sum / (kPartsPerThread * threads), 1e-9);
  for (const TilePart& tile : tiles)
    split(tile, static_cast<int>(std::ceil(tile.cost / most)), parts);
  std::stable_sort(parts.begin(), parts.end(),
                   [](const TilePart& a, const TilePart& b) { return a.cost > b.cost; });
  return parts;
}

int TileDrawing::draw(const PlacedFrame& placed, const TileGrid& grid, const DirtyCells& cells,
                      SkinDepth& depth, Frame& frame) {
  scratch_.each([](Scratch& one) { one.times = one.longest = {}; });
  const std::vector<TilePart> parts = shared_out(grid, cells, allowed_threads(), [&](int tile) {
    std::size_t items = placed.base.blocks_of(tile).size();
    for (const ActiveCamera& camera : placed.cameras) items += camera.tiles[tile].size();
    return items;
  });
  parallel_in_order(parts.size(),
                    [&](std::size_t i) { draw_part(placed, parts[i], depth, frame); });
  std::set<int> tiles;
  for (const TilePart& part : parts) tiles.insert(part.tile);
  return static_cast<int>(tiles.size());
}

void TileDrawing::draw_part(const PlacedFrame& placed, const TilePart& part, SkinDepth& depth,
                            Frame& frame) {
  const PixelBox& box = part.box;
  Scratch& own = scratch_.local();
  PhaseClock clock(placed.measure);
  DrawTimes times;
  own.spans.clear(box);
  TileLayers layers{placed};
  std::array<const TileKeys*, 3> drawn;
  for (const ActiveCamera& camera : placed.cameras) {
    const auto chunks = camera.tiles[part.tile];
    if (chunks.empty()) continue;
    TileKeys& keys = own.keys[layers.count];
    keys.clear(part.tile_box, box);
    splat(placed, camera, chunks, box, keys);
    drawn[layers.count] = &keys;
    own.spans.add(keys.spans);
    layers.layers[layers.count++] = {camera.set, &keys, camera.weight};
  }
  clock.lap(times.splat);
  if (const auto blocks = placed.base.blocks_of(part.tile); !blocks.empty()) {
    // From there on it has no weight beside samples; rounding included.
    const float behind_mm = 2.01f * placed.same_surface_mm();
    own.base.clear(box, placed.relit != nullptr || placed.keep_bound);
    own.samples.begin(box, std::span(drawn).first(layers.count));
    for (const std::uint32_t b : blocks)
      placed.base.draw(b, placed.faces, placed.view, behind_mm, own.samples, own.base);
    own.spans.add(own.base.spans);
    if (own.base.any_drawn) layers.base = &own.base;
  }
  clock.lap(times.base);
  resolve_tile(layers, own.spans, box, depth, frame);
  clock.lap(times.resolve);
  own.times += times;
  if (times.total() > own.longest.total()) own.longest = times;
}

void TileDrawing::count(const WorkSpan& all, DrawReport& report) const {
  DrawTimes sum, longest;
  scratch_.each([&](const Scratch& one) {
    sum += one.times;
    if (one.longest.total() > longest.total()) longest = one.longest;
  });
  // What is left shares the tiles out.
  sum.resolve += all.work_ms - sum.total();
  longest.resolve += all.span_ms - longest.total();
  report.times += sum;
  report.critical_path += longest;
}

}  // namespace organbake
