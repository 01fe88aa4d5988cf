// SPDX-License-Identifier: Apache-2.0
#include "drawing/splat.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "drawing/compaction.h"
#include "drawing/landing.h"
#include "drawing/tile_keys.h"
#include "picture/vector_loops.h"

namespace organbake {
namespace {

constexpr int kGuard = TileKeys::kGuard;

// A key's two halves.
struct Key {
  std::uint32_t low, high;
  std::uint64_t value() const { return std::uint64_t{high} << 32 | low; }
};

// The key with which a sample at depth z stands for a pixel (u, v) away.
inline Key make_key(float u, float v, float z, const ChunkFrame& c, float tie_mm,
                    std::uint32_t slot) {
  const bool own = std::max(std::abs(u), std::abs(v)) <= 1;
  const float depth = z + c.z_u * u + c.z_v * v + tie_mm * (u * u + v * v);
  const std::uint32_t v_bits = offset_bits(v);
  const std::uint32_t high = key_high(std::max(depth, kLeastDepth_mm), v_bits);
  // Whatever the low half says, kEmptyHigh never beats an empty cell.
  return {key_low(offset_bits(u), v_bits, slot), own ? high : kEmptyHigh};
}

// What a chunk's samples bring to the cells: halves of their keys.
struct KeyHalves {
  alignas(64) std::array<std::uint32_t, kChunk> low, high;
};
struct PackedKeys {
  alignas(64) std::array<std::uint64_t, kChunk> key;
  alignas(64) std::array<std::int32_t, kChunk> cell;
};

// KeyHalves of all samples for the pixel (du, dv) beyond their first one.
ORGANBAKE_MULTIVERSION void make_keys(const PlacedSamples& placed, std::uint32_t first_slot,
                                      float du, float dv, const ChunkFrame& c, float tie_mm,
                                      KeyHalves& __restrict keys) {
  const std::uint32_t* const sample = placed.sample->data();
  for (unsigned i = 0; i < whole_vectors(placed.count); ++i) {
    const Key key = make_key(placed.u[i] + du, placed.v[i] + dv, placed.z[i], c, tie_mm,
                             first_slot + sample[i]);
    keys.low[i] = key.low;
    keys.high[i] = key.high;
  }
}

// Of two to four pixels that a splat tries, its sample stands for about one. Moves those keys
// together and returns how many they are.
int pack(const KeyHalves& in, const PlacedSamples& placed, PackedKeys& out) {
  int kept = 0;
  for (int i = 0; i < placed.count; i += 8) {
    const unsigned there = lanes_unlike(&in.high[i], kEmptyHigh) & first_lanes(placed.count - i);
    const Compaction packed(there);
    packed(&in.low[i], &in.high[i], &out.key[kept]);
    packed(&placed.cell[i], &out.cell[kept]);
    kept += packed.count();
  }
  return kept;
}

// Whether any sample of the chunk can own the pixel (tx, ty) of its splat: a sample's place within
// its first pixel leaves each offset one pixel of play.
bool reaches(const ChunkFrame& c, int tx, int ty) {
  const float dx = static_cast<float>(tx) - 0.5f * static_cast<float>(c.columns - 1);
  const float dy = static_cast<float>(ty) - 0.5f * static_cast<float>(c.rows - 1);
  return std::abs(c.u_x * dx + c.u_y * dy) <= 1 + 0.5f * (std::abs(c.u_x) + std::abs(c.u_y)) &&
         std::abs(c.v_x * dx + c.v_y * dy) <= 1 + 0.5f * (std::abs(c.v_x) + std::abs(c.v_y));
}

// Splats of at most kGuard pixels a side: all samples of a chunk, pixel after pixel.
void splat_small(const PlacedSamples& placed, std::uint32_t first_slot, const ChunkFrame& c,
                 float tie_mm, TileKeys& tile) {
  KeyHalves keys;
  PackedKeys own;
  for (int ty = 0; ty < c.rows; ++ty) {
    for (int tx = 0; tx < c.columns; ++tx) {
      if (!reaches(c, tx, ty)) continue;
      const float du = c.u_x * static_cast<float>(tx) + c.u_y * static_cast<float>(ty);
      const float dv = c.v_x * static_cast<float>(tx) + c.v_y * static_cast<float>(ty);
      make_keys(placed, first_slot, du, dv, c, tie_mm, keys);
      const int packed = pack(keys, placed, own);
      std::uint64_t* const cells = tile.keys.data() + std::size_t(ty) * tile.stride + tx;
      for (int i = 0; i < packed; ++i) {
        std::uint64_t& cell = cells[own.cell[i]];
        cell = own.key[i] < cell ? own.key[i] : cell;
      }
    }
  }
}

// Larger splats, seen from very near: sample after sample, clipped to the tile.
void splat_large(const PlacedSamples& placed, std::uint32_t first_slot, const ChunkFrame& c,
                 float tie_mm, TileKeys& tile) {
  const int width = tile.box.width(), height = tile.box.height();
  for (int i = 0; i < placed.count; ++i) {
    const int column = kAnySplat.column(placed.cell[i]);
    const int row = kAnySplat.row(placed.cell[i]);
    const int first_x = std::max(0, -column), last_x = std::min(c.columns, width - column);
    const int first_y = std::max(0, -row), last_y = std::min(c.rows, height - row);
    for (int ty = first_y; ty < last_y; ++ty) {
      std::uint64_t* const cells =
          tile.keys.data() + std::size_t(row + ty + kGuard) * tile.stride + column + kGuard;
      for (int tx = first_x; tx < last_x; ++tx) {
        const float u =
            placed.u[i] + c.u_x * static_cast<float>(tx) + c.u_y * static_cast<float>(ty);
        const float v =
            placed.v[i] + c.v_x * static_cast<float>(tx) + c.v_y * static_cast<float>(ty);
        const std::uint32_t slot = first_slot + (*placed.sample)[i];
        cells[tx] = std::min(cells[tx], make_key(u, v, placed.z[i], c, tie_mm, slot).value());
      }
    }
  }
}

// Of a chunk's samples, from its first slot on.
template <class Number>
void prefetch_slots(const std::vector<Number>& numbers, std::size_t first) {
  constexpr std::size_t kLine = 64;  // bytes of a cache's
  for (std::size_t i = 0; i < kChunk; i += kLine / sizeof(Number))
    __builtin_prefetch(numbers.data() + first + i);
}

}  // namespace

void prefetch_chunk(const SampleSet& set, std::uint32_t chunk, bool smooth) {
  const std::size_t first = std::size_t{chunk} * kChunk;
  for (const auto* places : {&set.b1, &set.b2, &set.h}) prefetch_slots(*places, first);
  if (smooth)
    prefetch_slots(set.smooth, first);
  else
    prefetch_slots(set.detail, first);
}

void splat_chunk(const SampleSet& set, std::uint32_t chunk, const ChunkFrame& frame,
                 const FaceFrame& face, float near_mm, float tie_mm, TileKeys& tile) {
  const bool small = frame.columns <= kGuard && frame.rows <= kGuard;
  const CellGrid cells = small ? CellGrid{tile.stride, kGuard} : kAnySplat;
  PlacedSamples placed;
  place_samples(set, chunk, frame, face, near_mm, tile, cells, placed);
  if (placed.count == 0) return;
  const auto splat = small ? splat_small : splat_large;
  splat(placed, chunk * kChunk, frame, tie_mm, tile);
}

}  // namespace organbake
