// SPDX-License-Identifier: Apache-2.0
// Blends a tile's layers by the pixel in linear light, and lights them: from the keys that the
// cameras' samples left, and the base layer below them, to colours, depth and what each pixel
// shows.
#include <algorithm>
#include <limits>

#include "drawing/tile_drawing.h"

namespace organbake {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Whatever part of a picture is drawn, its groups of pixels are the same.
static_assert(TileGrid::kWidth % SparseShading::kGroup == 0 && kSpan % SparseShading::kGroup == 0 &&
              DirtyCells::kCell_px % SparseShading::kGroup == 0 &&
              DirtyCells::kCell_px % kSpanRows == 0 && kLanes % SparseShading::kGroup == 0);

// A span of one layer's row, decoded from its keys.
struct LayerSpan {
  alignas(64) float depth[kSpan], u[kSpan], v[kSpan];
  alignas(64) std::int32_t slot[kSpan];
};
using LayerSpans = std::array<LayerSpan, 3>;

// The layer whose sample speaks for a pixel: of the camera with the largest share of those that see
// the nearest skin, or nearly. The nearest sample itself may be of a camera that hardly counts
// there.
int leading_layer(const TileLayers& tile, const LayerSpans& rows, float nearest_mm, int i) {
  const float near_mm = nearest_mm + tile.frame.same_surface_mm();
  int leading = 0, nearest = 0;
  float share = 0;
  for (int l = 0; l < tile.count; ++l) {
    const float depth_mm = rows[l].depth[i], weight = tile.layers[l].weight;
    if (depth_mm < rows[nearest].depth[i]) nearest = l;
    if (depth_mm <= near_mm && weight > share) leading = l, share = weight;
  }
  return share > 0 ? leading : nearest;
}

// Whole vectors of a span.
struct Part {
  std::size_t first = 0;
  int count = 0;

  // That hold the pixels from `from` to `to`.
  static Part holding(int from, int to) {
    if (from >= to) return {};
    const int first = from & ~(static_cast<int>(kLanes) - 1);
    return {static_cast<std::size_t>(first), static_cast<int>(whole_vectors(to - first))};
  }
};

// The span's keys into their places. Beyond a row's end lie its own guard and the next row's.
// (That the count is one of whole vectors already is what the compiler has to see, here and below.)
static_assert(2 * TileKeys::kGuard >= kLanes - 1);
ORGANBAKE_MULTIVERSION void decode(const std::uint64_t* __restrict keys, const Part& part,
                                   float tie_mm, LayerSpan& __restrict row) {
  ORGANBAKE_LANES(4)
  for (unsigned k = 0; k < whole_vectors(part.count); ++k) {
    const std::size_t i = part.first + k;
    const std::uint32_t high = static_cast<std::uint32_t>(keys[i] >> 32);
    const std::uint32_t low = static_cast<std::uint32_t>(keys[i]);
    const float u = offset_share(u_bits_of(low));
    const float v = offset_share(v_bits_of(high, low));
    row.u[i] = kReach * u;
    row.v[i] = kReach * v;
    const float depth = depth_of(high) - tie_mm * (u * u + v * v);
    row.depth[i] = depth > kLeastDepth_mm ? depth : kLeastDepth_mm;
    row.slot[i] = static_cast<std::int32_t>(slot_of(low));
  }
}

// 1 on the nearest surface, falling to 0 behind it.
inline float surface_share(float depth, float nearest, float inverse_tolerance) {
  const float behind = 2 - (depth - nearest) * inverse_tolerance;
  const float low = behind > 0 ? behind : 0;  // also for inf − inf
  return low < 1 ? low : 1;
}

inline float high_byte(std::uint32_t word) {
  return static_cast<float>(static_cast<std::int32_t>(word >> 24));
}

// Square-root light, squared into linear light.
inline float linear_color(float value) {
  const float clamped = value > 0 ? value : 0;
  return clamped * clamped;
}

// Fetches the colours of a span's samples. One copy each, taken apart in registers afterwards,
// beats scattered loads of bytes.
void fetch(const LayerSpan& row, const TexelColors* __restrict colors, const Part& part,
           TexelColors* __restrict fetched) {
#pragma GCC unroll 8
  for (unsigned k = 0; k < whole_vectors(part.count); ++k)
    fetched[part.first + k] = colors[row.slot[part.first + k]];
}

// Sends for what the row below will fetch: a copy that has to wait for its colour keeps all that
// follow waiting, which this does not.
void send_for(const std::uint64_t* keys, const Part& part, const TexelColors* colors) {
#pragma GCC unroll 8
  for (unsigned k = 0; k < whole_vectors(part.count); ++k)
    __builtin_prefetch(colors + slot_of(static_cast<std::uint32_t>(keys[part.first + k])));
}

ORGANBAKE_MULTIVERSION void find_nearest(const LayerSpan& __restrict row, const Part& part,
                                         SumSpan& __restrict sum) {
  for (unsigned k = 0; k < whole_vectors(part.count); ++k) {
    const std::size_t i = part.first + k;
    sum.nearest[i] = row.depth[i] < sum.nearest[i] ? row.depth[i] : sum.nearest[i];
  }
}

ORGANBAKE_MULTIVERSION void add_layer(const LayerSpan& __restrict row,
                                      const TexelColors* __restrict colors, const Part& part,
                                      float weight, float inverse_tolerance,
                                      SumSpan& __restrict sum) {
  const float byte_weight = weight / 255;
  const auto within = [](float v) { return v > -0.5f ? (v < 0.5f ? v : 0.5f) : -0.5f; };
  for (unsigned k = 0; k < whole_vectors(part.count); ++k) {
    const std::size_t i = part.first + k;
    const TexelColors& texel = colors[i];
    const std::uint32_t c00 = texel[0], c10 = texel[1], c01 = texel[2], c11 = texel[3];
    const float u = within(row.u[i]), v = within(row.v[i]);
    // The texel's own colour, fading to its border, in the place of its corners' mean.
    const float own = (1 - 4 * u * u) * (1 - 4 * v * v), less = 0.25f * own;
    const float s = u + 0.5f, t = v + 0.5f, w11 = s * t - less, w10 = s - s * t - less;
    const float w01 = t - s * t - less, w00 = 1 - own - w11 - w10 - w01;
    // Bytes stay where they are in their word, which is a power of 2: a shift less for each.
    const auto channel = [&](std::uint32_t mask, float unit, std::uint32_t middle) {
      const auto at = [mask](std::uint32_t word) {
        return static_cast<float>(static_cast<std::int32_t>(word & mask));
      };
      const float corners = w00 * at(c00) + w10 * at(c10) + w01 * at(c01) + w11 * at(c11);
      return linear_color(unit * corners + own * high_byte(middle));
    };
    const float w = byte_weight * high_byte(c11) *
                    surface_share(row.depth[i], sum.nearest[i], inverse_tolerance);
    sum.red[i] += w * channel(0xFFu, 1, c00);
    sum.green[i] += w * channel(0xFF00u, 1.0f / 256, c10);
    sum.blue[i] += w * channel(0xFF0000u, 1.0f / 65536, c01);
    sum.weight[i] += w;
  }
}

// Where skin lies so many texels beside a sample.
[[gnu::always_inline]] inline std::array<float, 3> looked_at(const SampleSet& set,
                                                             std::uint32_t slot, float u, float v) {
  const Patch& patch = set.chunks[slot / kChunk].patch;
  std::array<float, 3> at = set.bound(slot);
  for (int k = 0; k < 3; ++k) at[k] += u * patch.along_u[k] + v * patch.along_v[k];
  return at;
}

// Where the skin of a span's pixels is bound: by their leading samples, and by the base layer
// where it hides them or there are none.
void write_bound(const TileLayers& tile, const LayerSpans& rows, int y, int x0, int count,
                 const SumSpan& sum, BoundPixel* bound) {
  for (int i = 0; i < count; ++i) {
    const int layer = leading_layer(tile, rows, sum.nearest[i], i);
    bound[i] = {};
    if (!(sum.nearest[i] < kInfinity)) continue;
    if (tile.count > 0 &&
        rows[layer].depth[i] < sum.nearest[i] + 2 * tile.frame.same_surface_mm()) {
      const SampleSet& set = *tile.layers[layer].set;
      const auto slot = static_cast<std::uint32_t>(rows[layer].slot[i]);
      const std::array<float, 3> at = looked_at(set, slot, rows[layer].u[i], rows[layer].v[i]);
      bound[i] = {set.face(slot), at[0], at[1], at[2], rows[layer].depth[i], sum.weight[i]};
    } else if (tile.base) {
      const std::size_t at = tile.base->at(x0 + i, y);
      const BaseTile::BoundPoint& base = tile.base->bound[at];
      bound[i] = {base.face, base.b1, base.b2, base.height_mm, tile.base->depth[at], sum.weight[i]};
    }
    if (tile.frame.coarser && bound[i].has_skin()) tile.frame.coarser->bind_to_whole(bound[i]);
  }
}

// A span's rows while they are blended and lit.
struct Span {
  int x0, y0, count, rows;
  std::array<LayerSpans, kSpanRows> layers;
  std::array<SumSpan, kSpanRows> sums;
  SparseShading::Rows by_base;  // above 0 where the base layer weighs more than all samples
};

// Lights what a span summed to, once: by each pixel's leading sample, or by the base layer where
// that weighs more than all samples. Whatever else counts lies on the same skin.
void relight(const TileLayers& tile, Span& span) {
  alignas(64) SparseShading::Rows depth, white;
  std::array<SpanColors, kSpanRows> colors;
  for (int r = 0; r < span.rows; ++r) {
    SumSpan& sum = span.sums[r];
    for (int i = 0; i < span.count; ++i) {
      depth[r][i] = sum.weight[i] > 0 ? sum.nearest[i] : kInfinity;
      white[r][i] = sum.weight[i] * kFullScale;
    }
    colors[r] = {span.x0,  span.y0 + r, span.count, {sum.red, sum.green, sum.blue},
                 white[r], depth[r]};
  }
  // The relief at the scope is finer than a texel: by what the pixel's own centre looks at.
  const float aside = tile.frame.relit->from_scope() ? 1 : 0;
  const auto add_skin = [&](std::int32_t pixel, SkinPixels& skin) {
    const auto number = static_cast<unsigned>(pixel);  // which a shift and a mask take apart
    const int r = static_cast<int>(number / kSpan), i = static_cast<int>(number % kSpan);
    if (tile.base && (&span.by_base[0][0])[number] > 0) {
      const std::size_t at = tile.base->at(span.x0 + i, span.y0 + r);
      const BaseTile::BoundPoint& bound = tile.base->bound[at];
      return skin.add(pixel, bound.face, bound.b1, bound.b2);
    }
    const LayerSpans& rows = span.layers[r];
    const int layer = leading_layer(tile, rows, (&depth[0][0])[number], i);
    const LayerSpan& row = rows[layer];
    const SampleSet& set = *tile.layers[layer].set;
    const auto slot = static_cast<std::uint32_t>(row.slot[i]);
    const auto at = looked_at(set, slot, aside * row.u[i], aside * row.v[i]);
    skin.add(pixel, set.face(slot), at[0], at[1]);
  };
  SparseShading lit(depth, span.rows, span.count, tile.frame.texel_mm);
  SkinPixels skin;
  std::array<std::int32_t, kMostSkin> film_at;
  const auto of_rows = std::span(colors).first(span.rows);
  int with_film;
  do {  // twice at most
    skin.count = 0;
    for (int k = 0; k < lit.knot_count(); ++k) add_skin(lit.knot(k), skin);
    skin.fill_up();
    with_film = tile.frame.relit->light(skin, lit, of_rows, film_at.data());
  } while (with_film == RelitSkin::kAskAnew);
  if (with_film == 0) return;
  skin.count = 0;
  for (int k = 0; k < with_film; ++k) add_skin(film_at[k], skin);
  skin.fill_up();
  tile.frame.relit->add_film(skin, of_rows);
}

void add_base(const BaseTile& base, int y, int x0, int count, float inverse_tolerance,
              SumSpan& sum) {
  const int row = y - base.box.y0, offset = x0 - base.box.x0;
  const int last = std::min(base.spans.last(row), offset + count);
  for (int column = std::max(base.spans.first(row), offset); column < last; ++column) {
    const std::size_t at = base.at(base.box.x0 + column, y);
    if (!base.drawn(at)) continue;
    const int i = column - offset;
    const BaseTile::Shade& shade = base.shade[at];
    // Never quite zero, so that it fills what the samples leave open.
    const float w = std::max(shade[3], 1e-6f) *
                    surface_share(base.depth[at], sum.nearest[i], inverse_tolerance);
    sum.red[i] += w * shade[0] * kFullScale;
    sum.green[i] += w * shade[1] * kFullScale;
    sum.blue[i] += w * shade[2] * kFullScale;
    sum.weight[i] += w;
  }
}

// Marks the pixels that only the base layer covers.
void mark_base(const SumSpan& sum, int count, Cover* __restrict cover) {
  for (int i = 0; i < count; ++i) {
    const bool base = (sum.nearest_sample[i] == kInfinity) & (cover[i] == Cover::samples);
    cover[i] = base ? Cover::base : cover[i];
  }
}

// Fills a plane of a span. The library's fill takes longer to begin than this to end.
void fill(float* plane, float value) {
  Eigen::Map<Eigen::Array<float, kSpan, 1>, Eigen::Aligned64>(plane).setConstant(value);
}

// The layers of a span's row, base included, as colour and weight sums.
void sum_row(const TileLayers& tile, int r, Span& span) {
  const int y = span.y0 + r, x0 = span.x0, count = span.count;
  LayerSpans& rows = span.layers[r];
  SumSpan& sum = span.sums[r];
  const float inverse_tolerance = 1 / tile.frame.same_surface_mm();
  fill(sum.nearest, kInfinity);
  std::array<Part, 3> parts;  // each layer's own
  for (int l = 0; l < tile.count; ++l) {
    const TileKeys& keys = *tile.layers[l].keys;
    const int row = y - keys.box.y0, offset = x0 - keys.box.x0;
    parts[l] = Part::holding(std::max(0, keys.spans.first(row) - offset),
                             std::min(count, keys.spans.last(row) - offset));
    if (tile.frame.relit || tile.frame.keep_bound) fill(rows[l].depth, kInfinity);
    decode(keys.row(y) + offset, parts[l], tile.frame.tie_mm(), rows[l]);
    send_for(keys.row(y + 1) + offset, parts[l], tile.layers[l].set->colors.data());
    find_nearest(rows[l], parts[l], sum);
  }
  if (tile.base) {
    std::copy_n(sum.nearest, kSpan, sum.nearest_sample);
    const float* const base_mm = tile.base->depth.data() + tile.base->at(x0, y);
    using Depths = Eigen::ArrayXf;
    Eigen::Map<Depths, Eigen::Aligned64> nearest(sum.nearest, count);
    nearest = nearest.min(Eigen::Map<const Depths>(base_mm, count));
  }
  for (float* plane : {sum.red, sum.green, sum.blue, sum.weight}) fill(plane, 0);
  for (int l = 0; l < tile.count; ++l) {
    const TileLayers::Layer& layer = tile.layers[l];
    alignas(64) std::array<TexelColors, kSpan> fetched;
    fetch(rows[l], layer.set->colors.data(), parts[l], fetched.data());
    add_layer(rows[l], fetched.data(), parts[l], layer.weight, inverse_tolerance, sum);
  }
  if (!tile.base) return;
  float* const by_base = span.by_base[r];
  if (tile.frame.relit) std::copy_n(sum.weight, kSpan, by_base);
  add_base(*tile.base, y, x0, count, inverse_tolerance, sum);
  for (int i = 0; tile.frame.relit && i < kSpan; ++i) by_base[i] = sum.weight[i] - 2 * by_base[i];
}

}  // namespace

void resolve_tile(const TileLayers& tile, const RowSpans& spans, const PixelBox& box,
                  SkinDepth& depth, Frame& frame) {
  const Background& background = tile.frame.background;
  Span span;
  const auto write = [&](int r) {
    const SumSpan& sum = span.sums[r];
    const int y = span.y0 + r;
    const std::size_t first = std::size_t(y) * frame.color.width + span.x0;
    Cover* const cover = &frame.cover[first];
    encode(sum, span.count, background.color(), frame.color.pixels.data() + 3 * first, cover);
    if (tile.frame.keep_bound)
      write_bound(tile, span.layers[r], y, span.x0, span.count, sum, &frame.bound[first]);
    if (tile.base) mark_base(sum, span.count, cover);
    depth.put(span.x0, y, span.count, sum.nearest);
    if (!frame.depth_mm.empty()) std::copy_n(sum.nearest, span.count, &frame.depth_mm[first]);
  };
  for (span.y0 = box.y0; span.y0 < box.y1; span.y0 += kSpanRows) {
    const int y0 = span.y0, y1 = std::min(y0 + kSpanRows, box.y1);
    span.rows = y1 - y0;
    // Boxes begin at such columns, too.
    const int x0 = (spans.first(y0 - box.y0) + box.x0) & ~(SparseShading::kGroup - 1);
    const int x1 = spans.last(y0 - box.y0) + box.x0;
    if (x0 >= x1) {
      background.fill({box.x0, y0, box.x1, y1}, depth, frame);
      continue;
    }
    background.fill({box.x0, y0, x0, y1}, depth, frame);
    background.fill({x1, y0, box.x1, y1}, depth, frame);
    for (span.x0 = x0; span.x0 < x1; span.x0 += kSpan) {
      span.count = std::min(kSpan, x1 - span.x0);
      for (int r = 0; r < span.rows; ++r) sum_row(tile, r, span);
      if (tile.frame.relit) relight(tile, span);
      for (int r = 0; r < span.rows; ++r) write(r);
    }
  }
}

Background::Background(const std::array<std::uint8_t, 3>& color) : color_(color) {
  for (std::size_t i = 0; i < row_.size(); ++i) row_[i] = color[i % 3];
}

void Background::fill(const PixelBox& box, SkinDepth& depth, Frame& frame) const {
  if (box.empty()) return;
  depth.clear(box);
  for (int y = box.y0; y < box.y1; ++y) {
    const std::size_t first = std::size_t(y) * frame.color.width + box.x0;
    std::copy_n(row_.data(), 3 * box.width(), frame.color.pixels.data() + 3 * first);
    std::fill_n(&frame.cover[first], box.width(), Cover::background);
    if (!frame.bound.empty()) std::fill_n(&frame.bound[first], box.width(), BoundPixel());
    if (!frame.depth_mm.empty()) std::fill_n(&frame.depth_mm[first], box.width(), kInfinity);
  }
}

}  // namespace organbake
