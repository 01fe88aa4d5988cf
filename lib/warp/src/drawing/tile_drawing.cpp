// SPDX-License-Identifier: Apache-2.0
#include "drawing/tile_drawing.h"

#include <algorithm>

#include "drawing/tile_keys.h"
#include "picture/phase_clock.h"

namespace organbake {
namespace {

bool too_near(const ChunkFrame& chunk) {
  return chunk.columns >= kMostSplat || chunk.rows >= kMostSplat;
}

constexpr int kTileShift = 40;  // of a triangle's number, BaseTile::cut_triangles

}  // namespace

void TileDrawing::begin(const PlacedFrame& placed) {
  placed_.emplace(placed);
  scratch_.each([](Scratch& one) {
    one.times = one.longest = {};
    one.base_triangles = 0;
    one.cut_triangles.clear();
  });
}

std::span<const std::uint32_t> TileDrawing::base_blocks(int tile) const {
  return placed_->base ? placed_->base->blocks_of(tile) : std::span<const std::uint32_t>();
}

bool TileDrawing::is_empty(int tile) const {
  return base_blocks(tile).empty() &&
         std::all_of(placed_->cameras.begin(), placed_->cameras.end(),
                     [&](const ActiveCamera& camera) { return camera.tiles[tile].empty(); });
}

void TileDrawing::splat(const ActiveCamera& camera, std::span<const std::uint32_t> chunks,
                        float tie_mm, const PixelBox& part, TileKeys& keys, RowSpans& spans) const {
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
      prefetch_chunk(*camera.set, chunks[i + kAhead], placed_->smooth);
    if (!touches(i)) continue;
    const std::uint32_t c = chunks[i];
    if (placed_->relit) placed_->relit->prefetch(camera.set->chunks[c].patch.face);
    // Texels larger than a splat may be would be squares in a lattice; the base layer is smooth.
    if (placed_->base && !placed_->base->empty() && too_near(camera.chunks[c])) continue;
    spans.add(camera.chunks[c].box);
    splat_chunk(*camera.set, c, camera.chunks[c], placed_->faces[camera.set->chunks[c].patch.face],
                static_cast<float>(placed_->view.near_mm), tie_mm, keys);
  }
}

const BaseTile* TileDrawing::draw_base(std::span<const std::uint32_t> blocks, const TilePart& part,
                                       std::span<const TileKeys* const> layers,
                                       Scratch& own) const {
  if (blocks.empty()) return nullptr;
  const BaseDrawing& base = *placed_->base;
  own.base.clear(part.box, placed_->relit != nullptr || placed_->keep_bound);
  own.base.drawn_of_tile = part.drawn;
  if (std::any_of(blocks.begin(), blocks.end(), [&](auto b) { return base.fills_gaps(b); })) {
    own.open.find(part.box, layers);
  }
  for (const std::uint32_t b : blocks) {
    base.draw(b, placed_->faces, placed_->view, own.open, own.base);
  }
  own.spans.add(own.base.spans);
  own.base_triangles += own.base.triangles - own.base.cut_triangles.size();
  for (const std::uint64_t number : own.base.cut_triangles)
    own.cut_triangles.push_back(std::uint64_t(part.tile) << kTileShift | number);
  if (own.base.triangles == 0) return nullptr;
  return &own.base;
}

int TileDrawing::draw(const TileGrid& grid, DirtyCells& cells, SkinDepth& depth, Frame& frame) {
  // By the world's light a span of a row is given gloss where any of its faces may shine: parts
  // would make other spans of it.
  const bool parts_differ = placed_->relit && !placed_->relit->from_scope();
  plan_.make(grid, cells, parts_differ ? 1 : allowed_threads(), [this](int tile) {
    std::size_t items = base_blocks(tile).size();
    for (const ActiveCamera& camera : placed_->cameras) items += camera.tiles[tile].size();
    return items;
  });
  const std::span<TilePart> parts = plan_.parts();
  parallel_in_order(parts.size(), [&](std::size_t i) {
    WorkMeter meter;
    draw_part(parts[i], depth, frame);
    parts[i].took_ms = meter.lap().work_ms;
  });
  plan_.learn();
  return plan_.tile_count();
}

void TileDrawing::draw_part(const TilePart& part, SkinDepth& depth, Frame& frame) {
  const int tile = part.tile;
  const PixelBox& box = part.box;
  if (is_empty(tile)) return placed_->background.fill(box, depth, frame);
  Scratch& own = scratch_.local();
  PhaseClock clock(placed_->measure);
  DrawTimes times;
  own.spans.clear(box);
  TileLayers layers;
  layers.tie_mm = kTieTexels * placed_->texel_mm;
  layers.same_surface_mm = 2 * placed_->texel_mm;
  layers.texel_mm = placed_->texel_mm;
  layers.smooth = placed_->smooth;
  layers.relit = placed_->relit;
  layers.rest = placed_->rest;
  layers.keep_bound = placed_->keep_bound;
  std::array<const TileKeys*, 3> drawn;
  for (const ActiveCamera& camera : placed_->cameras) {
    const auto chunks = camera.tiles[tile];
    if (chunks.empty()) continue;
    TileKeys& keys = own.keys[layers.count];
    RowSpans& spans = own.layer_spans[layers.count];
    keys.clear(part.tile_box, box);
    spans.clear(box);
    splat(camera, chunks, layers.tie_mm, box, keys, spans);
    drawn[layers.count] = &keys;
    own.spans.add(spans);
    layers.layers[layers.count++] = {camera.set, &keys, &spans, camera.weight};
  }
  clock.lap(times.splat);
  layers.base = draw_base(base_blocks(tile), part, std::span(drawn).first(layers.count), own);
  clock.lap(times.base);
  resolve_tile(layers, own.spans, box, placed_->background, depth, frame);
  clock.lap(times.resolve);
  own.times += times;
  if (times.total() > own.longest.total()) own.longest = times;
}

void TileDrawing::count(const WorkSpan& all, DrawReport& report) const {
  DrawTimes sum, longest;
  std::vector<std::uint64_t> cut;
  scratch_.each([&](const Scratch& one) {
    sum += one.times;
    if (one.longest.total() > longest.total()) longest = one.longest;
    report.base_triangles += one.base_triangles;
    cut.insert(cut.end(), one.cut_triangles.begin(), one.cut_triangles.end());
  });
  // Once for each tile, in how many of its parts they may lie.
  std::sort(cut.begin(), cut.end());
  report.base_triangles += std::unique(cut.begin(), cut.end()) - cut.begin();
  if (!placed_->measure) return;
  // What is left shares the tiles out, and makes background of those that are empty.
  sum.resolve += all.work_ms - sum.total();
  longest.resolve += all.span_ms - longest.total();
  report.times += sum;
  report.critical_path += longest;
}

}  // namespace organbake
