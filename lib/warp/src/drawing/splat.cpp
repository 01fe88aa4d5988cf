// SPDX-License-Identifier: Apache-2.0
// Splats samples into a tile: where they land in the view, and which keys they leave at its pixels.
#include "drawing/splat.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace organbake {
namespace {

struct Placement {
  float left, top;  // half a splat and half a pixel, from the tile's corner
  float half_columns, half_rows;
  float low_x, low_y, high_x, high_y;  // first pixels that still touch the part
  float stride, first_cell;            // cells of a row, and that of the tile's corner
};

Placement placement(const ChunkFrame& c, const TileKeys& tile, const CellGrid& cells) {
  const float half_columns = 0.5f * static_cast<float>(c.columns);
  const float half_rows = 0.5f * static_cast<float>(c.rows);
  const int x0 = tile.box.x0 - tile.origin_x, y0 = tile.box.y0 - tile.origin_y;
  return {.left = half_columns + 0.5f + static_cast<float>(tile.origin_x),
          .top = half_rows + 0.5f + static_cast<float>(tile.origin_y),
          .half_columns = half_columns,
          .half_rows = half_rows,
          .low_x = static_cast<float>(x0 - c.columns + 1),
          .low_y = static_cast<float>(y0 - c.rows + 1),
          .high_x = static_cast<float>(x0 + tile.box.width() - 1),
          .high_y = static_cast<float>(y0 + tile.box.height() - 1),
          .stride = static_cast<float>(cells.stride),
          .first_cell = static_cast<float>((cells.guard - y0) * cells.stride + cells.guard - x0)};
}

inline float lowest_of(float a, float b) { return a < b ? a : b; }
inline float highest_of(float a, float b) { return a > b ? a : b; }

// A face's matrix for one of its patches: from the samples' places instead of (b1, b2, h). The
// shell map's terms are the same, 1, b1, b2, h, h·b1, h·b2, b1², b1·b2 and b2².
ShellColumns patch_matrix(const ShellColumns& face, const Patch& patch) {
  const auto [c1, c2, ch] = patch.center;
  const float e1 = patch.extent[0] / kFullCoordinate, e2 = patch.extent[1] / kFullCoordinate,
              eh = patch.extent[2] / kFullCoordinate;
  const Eigen::Vector4f by_h = face.col(3) + c1 * face.col(4) + c2 * face.col(5);
  ShellColumns m;
  const Eigen::Vector4f bend1 = c1 * face.col(6) + c2 * face.col(7), bend2 = c2 * face.col(8);
  m.col(0) = face.col(0) + c1 * (face.col(1) + bend1) + c2 * (face.col(2) + bend2) + ch * by_h;
  m.col(1) = e1 * (face.col(1) + ch * face.col(4) + bend1 + c1 * face.col(6));
  m.col(2) = e2 * (face.col(2) + ch * face.col(5) + 2 * bend2 + c1 * face.col(7));
  m.col(3) = eh * by_h;
  m.col(4) = eh * e1 * face.col(4);
  m.col(5) = eh * e2 * face.col(5);
  m.col(6) = e1 * e1 * face.col(6);
  m.col(7) = e1 * e2 * face.col(7);
  m.col(8) = e2 * e2 * face.col(8);
  return m;
}

// The hot loop: 24 multiply-adds and a reciprocal per sample, then its first pixel, and whether
// that is inside. It runs over whole vectors of the chunk's slots, of which `count` are samples.
ORGANBAKE_MULTIVERSION void place(const SampleSet& set, std::size_t first, int count,
                                  const ShellColumns& matrix, const ChunkFrame& c,
                                  const Placement& at, float near_mm,
                                  PlacedSamples& __restrict out) {
  const PatchCoordinate *const of_b1 = set.b1.data() + first, *const of_b2 = set.b2.data() + first,
                               *const of_h = set.h.data() + first;
  float m[3][9];
  for (int r = 0; r < 3; ++r) {
    for (int k = 0; k < 9; ++k) m[r][k] = matrix(r, k);
  }
  for (unsigned i = 0; i < whole_vectors(count); ++i) {
    const float b1 = of_b1[i], b2 = of_b2[i], h = of_h[i];
    const auto coordinate = [&](int r) __attribute__((always_inline)) {
      const float flat =
          m[r][0] + b1 * m[r][1] + b2 * m[r][2] + h * (m[r][3] + b1 * m[r][4] + b2 * m[r][5]);
      return flat + b1 * (b1 * m[r][6] + b2 * m[r][7]) + b2 * b2 * m[r][8];
    };
    const float x = coordinate(0), y = coordinate(1), z = coordinate(2);
    const float inverse = 1 / highest_of(z, near_mm);
    // Clamped one step beyond what is accepted: whatever rounding makes of a view from a thousand
    // kilometres or of a vertex as far off, a splat stays within the guard band. NaN goes low.
    const float s = lowest_of(highest_of(x * inverse - at.left, at.low_x - 1), at.high_x + 1);
    const float t = lowest_of(highest_of(y * inverse - at.top, at.low_y - 1), at.high_y + 1);
    out.inside[i] = (static_cast<int>(i) < count) & (z > near_mm) & (s > at.low_x - 1) &
                    (s <= at.high_x) & (t > at.low_y - 1) & (t <= at.high_y);
    const float column = std::ceil(s), row = std::ceil(t);
    const float dx = column - s - at.half_columns, dy = row - t - at.half_rows;
    out.u[i] = c.u_x * dx + c.u_y * dy;
    out.v[i] = c.v_x * dx + c.v_y * dy;
    out.z[i] = z;
    out.cell[i] = static_cast<std::int32_t>(row * at.stride + column + at.first_cell);
  }
}

// Whether all of a chunk's samples touch the tile. Its box is cut off at the view's border: one
// that touches the tile's own may go on beyond.
bool lies_within(const ChunkFrame& c, float near_mm, const PixelBox& tile) {
  return c.nearest_mm > near_mm && c.box.x0 > tile.x0 && c.box.y0 > tile.y0 && c.box.x1 < tile.x1 &&
         c.box.y1 < tile.y1;
}

// Moves the samples that touch the tile together.
void compact(PlacedSamples& placed) {
  int kept = 0;
  for (int i = 0; i < placed.count; i += 8) {
    const Compaction packed(lanes_unlike(&placed.inside[i], 0));
    packed(&placed.u[i], &placed.u[kept]);
    packed(&placed.v[i], &placed.v[kept]);
    packed(&placed.z[i], &placed.z[kept]);
    packed(&placed.cell[i], &placed.cell[kept]);
    packed(&placed.sample[i], &placed.sample[kept]);
    kept += packed.count();
  }
  placed.count = kept;
}

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
  const std::uint32_t* const sample = placed.sample.data();
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
#pragma GCC unroll 4
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
        const std::uint32_t slot = first_slot + placed.sample[i];
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

void place_samples(const SampleSet& set, std::uint32_t chunk, const ChunkFrame& frame,
                   const FaceFrame& face, float near_mm, const TileKeys& tile,
                   const CellGrid& cells, PlacedSamples& placed) {
  const std::size_t first = std::size_t{chunk} * kChunk;
  const Placement at = placement(frame, tile, cells);
  const ShellColumns matrix = patch_matrix(face.pixel, set.chunks[chunk].patch);
  placed.count = static_cast<int>(set.chunks[chunk].count);
  place(set, first, placed.count, matrix, frame, at, near_mm, placed);
  std::iota(placed.sample.begin(), placed.sample.end(), 0u);
  if (!lies_within(frame, near_mm, tile.box)) compact(placed);
}

void prefetch_chunk(const SampleSet& set, std::uint32_t chunk) {
  const std::size_t first = std::size_t{chunk} * kChunk;
  for (const auto* places : {&set.b1, &set.b2, &set.h}) prefetch_slots(*places, first);
  prefetch_slots(set.colors, first);
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
