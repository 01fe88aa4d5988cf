// SPDX-License-Identifier: Apache-2.0
#include "warp/resolve.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "image/srgb.h"
#include "warp/tile_grid.h"

namespace organbake {
namespace {

constexpr int kRow = TileGrid::kWidth;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kFullScale = 255.0f * 255.0f;  // square-root light squared

// One row of one layer, decoded from its keys.
struct LayerRow {
  alignas(32) float depth[kRow], u[kRow], v[kRow];
  alignas(32) std::int32_t slot[kRow];
};

// One row of the picture while it is summed: colour × weight in 0…255², and the weight.
struct SumRow {
  alignas(32) float red[kRow], green[kRow], blue[kRow], weight[kRow], nearest[kRow];
};

void decode(const std::uint64_t* __restrict keys, int count, float tie_mm,
            LayerRow& __restrict row) {
  for (int i = 0; i < count; ++i) {
    const std::uint32_t high = static_cast<std::uint32_t>(keys[i] >> 32);
    const std::uint32_t low = static_cast<std::uint32_t>(keys[i]);
    const float u = offset_share(u_bits_of(low));
    const float v = offset_share(v_bits_of(high, low));
    row.u[i] = kReach * u;
    row.v[i] = kReach * v;
    row.depth[i] = depth_of(high) - tie_mm * (u * u + v * v);
    row.slot[i] = static_cast<std::int32_t>(slot_of(low));
  }
}

// 1 on the nearest surface, falling to 0 behind it.
inline float surface_share(float depth, float nearest, float inverse_tolerance) {
  const float behind = 2 - (depth - nearest) * inverse_tolerance;
  const float low = behind > 0 ? behind : 0;  // also for inf − inf
  return low < 1 ? low : 1;
}

inline float signed_byte(std::uint32_t word, int shift_left) {
  return static_cast<float>(static_cast<std::int32_t>(word << shift_left) >> 24);
}
inline float unsigned_byte(std::uint32_t word, int shift) {
  return static_cast<float>(static_cast<std::int32_t>((word >> shift) & 255u));
}

// The Taylor colour at the pixel's centre, squared into linear light.
inline float linear_color(float c, float cu, float cv, float cuu, float cvv, float u, float v) {
  const float value = c + u * (cu + u * cuu) + v * (cv + v * cvv);
  const float clamped = value > 0 ? value : 0;
  return clamped * clamped;
}

// Fetches the details of a row's samples. One 16-byte copy each, taken apart in registers
// afterwards, beats four scattered loads of four bytes.
void fetch(const LayerRow& row, const PackedDetail* __restrict detail, int count,
           PackedDetail* __restrict fetched) {
  for (int i = 0; i < count; ++i) fetched[i] = detail[row.slot[i]];
}

void add_layer(const LayerRow& __restrict row, const PackedDetail* __restrict detail, int count,
               float weight, float inverse_tolerance, SumRow& __restrict sum) {
  const float byte_weight = weight / 255;
  for (int i = 0; i < count; ++i) {
    const std::uint32_t w0 = detail[i][0], w1 = detail[i][1], w2 = detail[i][2],
                        w3 = detail[i][3];
    const float u = row.u[i], v = row.v[i];
    const float r = linear_color(unsigned_byte(w0, 0), signed_byte(w1, 24), signed_byte(w1, 0),
                                 signed_byte(w2, 8), signed_byte(w3, 16), u, v);
    const float g = linear_color(unsigned_byte(w0, 8), signed_byte(w1, 16), signed_byte(w2, 24),
                                 signed_byte(w2, 0), signed_byte(w3, 8), u, v);
    const float b = linear_color(unsigned_byte(w0, 16), signed_byte(w1, 8), signed_byte(w2, 16),
                                 signed_byte(w3, 24), signed_byte(w3, 0), u, v);
    const float w = byte_weight * unsigned_byte(w0, 24) *
                    surface_share(row.depth[i], sum.nearest[i], inverse_tolerance);
    sum.red[i] += w * r;
    sum.green[i] += w * g;
    sum.blue[i] += w * b;
    sum.weight[i] += w;
  }
}

void add_base(const BaseTile& base, int y, int x0, int count, float inverse_tolerance,
              SumRow& sum) {
  const std::size_t first = base.at(x0, y);
  for (int i = 0; i < count; ++i) {
    const std::size_t at = first + static_cast<std::size_t>(i);
    if (!(base.depth[at] < kInfinity)) continue;
    // Never quite zero, so that it fills what the samples leave open.
    const float w = std::max(base.weight[at], 1e-6f) *
                    surface_share(base.depth[at], sum.nearest[i], inverse_tolerance);
    sum.red[i] += w * base.red[at] * kFullScale;
    sum.green[i] += w * base.green[at] * kFullScale;
    sum.blue[i] += w * base.blue[at] * kFullScale;
    sum.weight[i] += w;
  }
}

constexpr int kEncodeSteps = 16384;  // an eighth of an 8-bit level in the darkest tones
const std::array<std::uint8_t, kEncodeSteps>& encode_table() {
  static const auto table = [] {
    std::array<std::uint8_t, kEncodeSteps> t{};
    for (int i = 0; i < kEncodeSteps; ++i) {
      t[i] = srgb8_from_linear(static_cast<float>(i) / (kEncodeSteps - 1));
    }
    return t;
  }();
  return table;
}

// Sums to sRGB bytes.
void encode(SumRow& sum, int count, const std::array<std::uint8_t, 3>& background,
            std::uint8_t* rgb, Cover* cover) {
  const auto& table = encode_table();
  alignas(32) std::int32_t level[3][kRow];
  alignas(32) float scale[kRow];
  for (int i = 0; i < count; ++i) {
    scale[i] = ((kEncodeSteps - 1) / kFullScale) / (sum.weight[i] > 0 ? sum.weight[i] : 1.0f);
  }
  const auto levels = [&](const float* __restrict color, std::int32_t* __restrict out) {
    for (int i = 0; i < count; ++i) {
      const float scaled = color[i] * scale[i] + 0.5f;
      out[i] = static_cast<std::int32_t>(scaled < kEncodeSteps - 1 ? scaled : kEncodeSteps - 1);
    }
  };
  levels(sum.red, level[0]), levels(sum.green, level[1]), levels(sum.blue, level[2]);
  for (int i = 0; i < count; ++i) {
    const bool drawn = sum.weight[i] > 0;
    for (int k = 0; k < 3; ++k) rgb[3 * i + k] = drawn ? table[level[k][i]] : background[k];
    cover[i] = drawn ? Cover::samples : Cover::background;
  }
}

// Pixels that only the base layer covers.
std::size_t mark_base(const std::array<LayerRow, 3>& rows, int layers, int count, Cover* cover) {
  std::size_t marked = 0;
  for (int i = 0; i < count; ++i) {
    if (cover[i] != Cover::samples) continue;
    bool sampled = false;
    for (int l = 0; l < layers; ++l) sampled |= rows[l].depth[i] < kInfinity;
    if (sampled) continue;
    cover[i] = Cover::base;
    ++marked;
  }
  return marked;
}

}  // namespace

ResolveCounts resolve_tile(const TileLayers& tile, const PixelBox& box,
                           const std::array<std::uint8_t, 3>& background, Frame& frame) {
  ResolveCounts counts;
  std::array<LayerRow, 3> rows;
  SumRow sum;
  alignas(32) std::array<PackedDetail, kRow> fetched;
  const int count = box.width(), padded = (count + 7) & ~7;
  const float inverse_tolerance = 1 / tile.same_surface_mm;
  const bool has_base = tile.base && tile.base->drawn;
  for (int y = box.y0; y < box.y1; ++y) {
    std::fill_n(sum.nearest, padded, kInfinity);
    if (has_base) {
      std::copy_n(tile.base->depth.data() + tile.base->at(box.x0, y), count, sum.nearest);
    }
    for (int l = 0; l < tile.count; ++l) {
      // The guard band makes whole vectors safe to read.
      decode(tile.layers[l].keys->row(y) + (box.x0 - tile.layers[l].keys->box.x0), padded,
             tile.tie_mm, rows[l]);
      for (int i = 0; i < padded; ++i) {
        sum.nearest[i] = rows[l].depth[i] < sum.nearest[i] ? rows[l].depth[i] : sum.nearest[i];
      }
    }
    for (float* plane : {sum.red, sum.green, sum.blue, sum.weight})
      std::fill_n(plane, padded, 0.0f);
    for (int l = 0; l < tile.count; ++l) {
      fetch(rows[l], tile.layers[l].set->detail.data(), padded, fetched.data());
      add_layer(rows[l], fetched.data(), padded, tile.layers[l].weight, inverse_tolerance, sum);
    }
    if (has_base) add_base(*tile.base, y, box.x0, count, inverse_tolerance, sum);
    const std::size_t first = std::size_t(y) * frame.color.width + box.x0;
    encode(sum, count, background, frame.color.pixels.data() + 3 * first, &frame.cover[first]);
    if (has_base) counts.base_pixels += mark_base(rows, tile.count, count, &frame.cover[first]);
    for (int i = 0; i < count; ++i)
      counts.sample_pixels += frame.cover[first + i] == Cover::samples;
    if (!frame.depth_mm.empty()) std::copy_n(sum.nearest, count, &frame.depth_mm[first]);
  }
  return counts;
}

void fill_background(const PixelBox& box, const std::array<std::uint8_t, 3>& background,
                     Frame& frame) {
  std::array<std::uint8_t, 3 * kRow> pattern;
  for (int i = 0; i < 3 * kRow; ++i) pattern[i] = background[i % 3];
  for (int y = box.y0; y < box.y1; ++y) {
    const std::size_t first = std::size_t(y) * frame.color.width + box.x0;
    std::copy_n(pattern.data(), 3 * box.width(), frame.color.pixels.data() + 3 * first);
    std::fill_n(&frame.cover[first], box.width(), Cover::background);
    if (!frame.depth_mm.empty()) std::fill_n(&frame.depth_mm[first], box.width(), kInfinity);
  }
}

}  // namespace organbake
