// SPDX-License-Identifier: Apache-2.0
#include "warp/splat.h"

#include <algorithm>
#include <cmath>

#include "warp/left_pack.h"
#include "warp/tile_grid.h"
#include "warp/wide.h"

namespace organbake {
namespace {

constexpr int kGuard = TileKeys::kGuard;

// Where a chunk's samples land: offset from each sample to its first pixel's centre, depth, that
// pixel's cell; and of a chunk that the tile cuts, whether the splat touches the tile at all.
static_assert(kChunk % kLanes == 0);
struct Landed {
  alignas(64) float u[kChunk], v[kChunk], z[kChunk];
  alignas(64) std::int32_t cell[kChunk];
  alignas(64) std::uint32_t inside[kChunk];
};

// Places within a chunk: of all its samples, or of those that are left.
using Places = std::array<std::uint32_t, kChunk>;
constexpr Places kAllPlaces = [] {
  Places all{};
  for (std::uint32_t i = 0; i < kChunk; ++i) all[i] = i;
  return all;
}();

// How a pixel of the tile becomes the number of its cell.
struct CellGrid {
  int stride, guard;  // cells of a row; beyond each of the tile's borders
};
// For splats that may begin farther outside than a tile's own guard band.
constexpr CellGrid kAnySplat{1024, kMostSplat + 1};
static_assert(TileGrid::kWidth + 2 * kAnySplat.guard <= kAnySplat.stride);
static_assert((TileGrid::kHeight + 2 * kAnySplat.guard) * kAnySplat.stride <= 1 << 24);  // a float

struct Placement {
  float left, top;  // half a splat and half a pixel, from the tile's corner
  float half_columns, half_rows;
  float low_x, low_y, high_x, high_y;  // first pixels that still touch the part
  float stride, first_cell;            // cells of a row, and that of the tile's corner
};

inline float lowest_of(float a, float b) { return a < b ? a : b; }
inline float highest_of(float a, float b) { return a > b ? a : b; }

// A face's matrix for one of its patches: from the samples' places instead of (b1, b2, h). The
// shell map's terms are the same, 1, b1, b2, h, h·b1 and h·b2.
ShellColumns patch_matrix(const ShellColumns& face, const Patch& patch) {
  const auto [c1, c2, ch] = patch.center;
  const float e1 = patch.extent[0] / kFullPlace, e2 = patch.extent[1] / kFullPlace,
              eh = patch.extent[2] / kFullPlace;
  const Eigen::Vector4f by_h = face.col(3) + c1 * face.col(4) + c2 * face.col(5);
  ShellColumns m;
  m.col(0) = face.col(0) + c1 * face.col(1) + c2 * face.col(2) + ch * by_h;
  m.col(1) = e1 * (face.col(1) + ch * face.col(4));
  m.col(2) = e2 * (face.col(2) + ch * face.col(5));
  m.col(3) = eh * by_h;
  m.col(4) = eh * e1 * face.col(4);
  m.col(5) = eh * e2 * face.col(5);
  return m;
}

// Three streams of samples' places within their patch.
struct Sampled {
  const Place *b1, *b2, *h;
};

// The hot loop: 15 multiply-adds and a reciprocal per sample, then its first pixel. It runs over
// all slots of the chunk. Where the tile cuts the chunk, it tells which of its `count` samples are
// inside.
template <bool kCut>
[[gnu::always_inline]] inline void land(const Sampled& sampled, int count,
                                        const ShellColumns& matrix, const ChunkFrame& c,
                                        const Placement& at, float near_mm,
                                        Landed& __restrict out) {
  float m[3][6];
  for (int r = 0; r < 3; ++r) {
    for (int k = 0; k < 6; ++k) m[r][k] = matrix(r, k);
  }
  for (int i = 0; i < static_cast<int>(kChunk); ++i) {
    const float b1 = sampled.b1[i], b2 = sampled.b2[i], h = sampled.h[i];
    const float x =
        m[0][0] + b1 * m[0][1] + b2 * m[0][2] + h * (m[0][3] + b1 * m[0][4] + b2 * m[0][5]);
    const float y =
        m[1][0] + b1 * m[1][1] + b2 * m[1][2] + h * (m[1][3] + b1 * m[1][4] + b2 * m[1][5]);
    const float z =
        m[2][0] + b1 * m[2][1] + b2 * m[2][2] + h * (m[2][3] + b1 * m[2][4] + b2 * m[2][5]);
    const float inverse = 1 / (kCut ? highest_of(z, near_mm) : z);
    // Clamped one step beyond what is accepted: whatever rounding makes of a view from a thousand
    // kilometres or of a vertex as far off, a splat stays within the guard band. NaN goes low.
    const float s = lowest_of(highest_of(x * inverse - at.left, at.low_x - 1), at.high_x + 1);
    const float t = lowest_of(highest_of(y * inverse - at.top, at.low_y - 1), at.high_y + 1);
    if constexpr (kCut) {
      out.inside[i] = (i < count) & (z > near_mm) & (s > at.low_x - 1) & (s <= at.high_x) &
                      (t > at.low_y - 1) & (t <= at.high_y);
    }
    const float column = std::ceil(s), row = std::ceil(t);
    const float dx = column - s - at.half_columns, dy = row - t - at.half_rows;
    out.u[i] = c.u_x * dx + c.u_y * dy;
    out.v[i] = c.v_x * dx + c.v_y * dy;
    out.z[i] = z;
    out.cell[i] = static_cast<std::int32_t>(row * at.stride + column + at.first_cell);
  }
}

ORGANBAKE_WIDE void land_cut(const Sampled& sampled, int count, const ShellColumns& matrix,
                             const ChunkFrame& c, const Placement& at, float near_mm,
                             Landed& __restrict out) {
  land<true>(sampled, count, matrix, c, at, near_mm, out);
}

ORGANBAKE_WIDE void land_uncut(const Sampled& sampled, const ShellColumns& matrix,
                               const ChunkFrame& c, const Placement& at, Landed& __restrict out) {
  land<false>(sampled, static_cast<int>(kChunk), matrix, c, at, 0, out);
}

// A key's two halves.
struct Key {
  std::uint32_t low, high;
  std::uint64_t value() const { return std::uint64_t{high} << 32 | low; }
};

// The key with which a sample at depth z stands for a pixel (u, v) away.
inline Key make_key(float u, float v, float z, const ChunkFrame& c, float tie_mm,
                    std::uint32_t slot) {
  const bool own = highest_of(std::abs(u), std::abs(v)) <= 1;
  const float depth = z + c.z_u * u + c.z_v * v + tie_mm * (u * u + v * v);
  const std::uint32_t v_bits = offset_bits(v);
  const std::uint32_t high = key_high(highest_of(depth, kLeastDepth_mm), v_bits);
  // Whatever the low half says, kEmptyHigh never beats an empty cell.
  return {key_low(offset_bits(u), v_bits, slot), own ? high : kEmptyHigh};
}

// What a chunk's samples bring to the cells: halves of their keys.
struct Bids {
  alignas(64) std::array<std::uint32_t, kChunk> low, high;
};
struct PackedBids {
  alignas(64) std::array<std::uint64_t, kChunk> key;
  alignas(64) std::array<std::int32_t, kChunk> cell;
};

// A chunk's samples that touch the tile.
struct Touching {
  const Landed& landed;
  const Places& place;  // within the chunk
  int count;
  std::uint32_t first_slot;
};

// Bids of all samples for the pixel (du, dv) beyond their first one.
ORGANBAKE_WIDE void make_bids(const Touching& samples, float du, float dv, const ChunkFrame& c,
                              float tie_mm, Bids& __restrict bids) {
  const Landed& in = samples.landed;
  const std::uint32_t* const place = samples.place.data();
  const std::uint32_t first_slot = samples.first_slot;
  for (unsigned i = 0; i < whole_vectors(samples.count); ++i) {
    const Key key = make_key(in.u[i] + du, in.v[i] + dv, in.z[i], c, tie_mm, first_slot + place[i]);
    bids.low[i] = key.low;
    bids.high[i] = key.high;
  }
}

// Of two to four pixels that a splat tries, its sample stands for about one. Moves those bids
// together and returns how many they are.
int pack(const Bids& in, const Touching& samples, PackedBids& out) {
  int kept = 0;
  for (int i = 0; i < samples.count; i += 8) {
    const unsigned there = lanes_unlike(&in.high[i], kEmptyHigh) & first_lanes(samples.count - i);
    const LeftPack packed(there);
    packed(&in.low[i], &in.high[i], &out.key[kept]);
    packed(&samples.landed.cell[i], &out.cell[kept]);
    kept += packed.count();
  }
  return kept;
}

// Moves the samples that touch the tile together; returns how many they are.
int compact(Landed& landed, Places& place) {
  int kept = 0;
  for (std::uint32_t i = 0; i < kChunk; i += 8) {
    const LeftPack packed(lanes_unlike(landed.inside + i, 0));
    packed(landed.u + i, landed.u + kept);
    packed(landed.v + i, landed.v + kept);
    packed(landed.z + i, landed.z + kept);
    packed(landed.cell + i, landed.cell + kept);
    packed(&place[i], &place[kept]);
    kept += packed.count();
  }
  return kept;
}

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

// Whether any sample of the chunk can own the pixel (tx, ty) of its splat: a sample's place within
// its first pixel leaves each offset one pixel of play.
bool reaches(const ChunkFrame& c, int tx, int ty) {
  const float dx = static_cast<float>(tx) - 0.5f * static_cast<float>(c.columns - 1);
  const float dy = static_cast<float>(ty) - 0.5f * static_cast<float>(c.rows - 1);
  return std::abs(c.u_x * dx + c.u_y * dy) <= 1 + 0.5f * (std::abs(c.u_x) + std::abs(c.u_y)) &&
         std::abs(c.v_x * dx + c.v_y * dy) <= 1 + 0.5f * (std::abs(c.v_x) + std::abs(c.v_y));
}

// Splats of at most kGuard pixels a side: all samples of a chunk, pixel after pixel.
void splat_small(const Touching& samples, const ChunkFrame& c, float tie_mm, TileKeys& tile) {
  Bids bids;
  PackedBids own;
  for (int ty = 0; ty < c.rows; ++ty) {
    for (int tx = 0; tx < c.columns; ++tx) {
      if (!reaches(c, tx, ty)) continue;
      const float du = c.u_x * static_cast<float>(tx) + c.u_y * static_cast<float>(ty);
      const float dv = c.v_x * static_cast<float>(tx) + c.v_y * static_cast<float>(ty);
      make_bids(samples, du, dv, c, tie_mm, bids);
      const int bidding = pack(bids, samples, own);
      std::uint64_t* const cells = tile.keys.data() + std::size_t(ty) * tile.stride + tx;
      for (int i = 0; i < bidding; ++i) {
        std::uint64_t& cell = cells[own.cell[i]];
        cell = own.key[i] < cell ? own.key[i] : cell;
      }
    }
  }
}

// Larger splats, seen from very near: sample after sample, clipped to the tile.
void splat_large(const Touching& samples, const ChunkFrame& c, float tie_mm, TileKeys& tile) {
  const Landed& landed = samples.landed;
  const int width = tile.box.width(), height = tile.box.height();
  for (int i = 0; i < samples.count; ++i) {
    const int column = landed.cell[i] % kAnySplat.stride - kAnySplat.guard;
    const int row = landed.cell[i] / kAnySplat.stride - kAnySplat.guard;
    const int first_x = std::max(0, -column), last_x = std::min(c.columns, width - column);
    const int first_y = std::max(0, -row), last_y = std::min(c.rows, height - row);
    for (int ty = first_y; ty < last_y; ++ty) {
      std::uint64_t* const cells =
          tile.keys.data() + std::size_t(row + ty + kGuard) * tile.stride + column + kGuard;
      for (int tx = first_x; tx < last_x; ++tx) {
        const float u =
            landed.u[i] + c.u_x * static_cast<float>(tx) + c.u_y * static_cast<float>(ty);
        const float v =
            landed.v[i] + c.v_x * static_cast<float>(tx) + c.v_y * static_cast<float>(ty);
        const std::uint32_t slot = samples.first_slot + samples.place[i];
        cells[tx] = std::min(cells[tx], make_key(u, v, landed.z[i], c, tie_mm, slot).value());
      }
    }
  }
}

}  // namespace

void TileKeys::clear(const PixelBox& tile, const PixelBox& part) {
  box = part;
  origin_x = tile.x0, origin_y = tile.y0;
  stride = part.width() + 2 * kGuard;
  keys.assign(std::size_t(stride) * (part.height() + 2 * kGuard), kEmptyKey);
}

void send_for_chunk(const SampleSet& set, std::uint32_t chunk) {
  constexpr std::uint32_t kLine = 64;  // bytes of a cache's
  const std::size_t first = std::size_t{chunk} * kChunk;
  for (std::uint32_t i = 0; i < kChunk; i += kLine / sizeof(Place)) {
    for (const Place* place : {set.b1.data(), set.b2.data(), set.h.data()})
      __builtin_prefetch(place + first + i);
  }
  for (std::uint32_t i = 0; i < kChunk; i += kLine / sizeof(PackedDetail))
    __builtin_prefetch(set.detail.data() + first + i, 0, 2);  // for later
}

void splat_chunk(const SampleSet& set, std::uint32_t chunk, const ChunkFrame& frame,
                 const FaceFrame& face, float near_mm, float tie_mm, TileKeys& tile) {
  const std::uint32_t first = chunk * kChunk;
  const bool small = frame.columns <= kGuard && frame.rows <= kGuard;
  const Placement at = placement(frame, tile, small ? CellGrid{tile.stride, kGuard} : kAnySplat);
  const ShellColumns matrix = patch_matrix(face.pixel, set.chunks[chunk].patch);
  const Sampled sampled{set.b1.data() + first, set.b2.data() + first, set.h.data() + first};
  int count = static_cast<int>(set.chunks[chunk].count);
  Landed landed;
  Places left;
  const bool uncut = frame.uncut && intersected(frame.box, tile.box) == frame.box;
  if (uncut) {
    land_uncut(sampled, matrix, frame, at, landed);
  } else {
    land_cut(sampled, count, matrix, frame, at, near_mm, landed);
    left = kAllPlaces;
    count = compact(landed, left);
    if (count == 0) return;
  }
  const Touching samples{landed, uncut ? kAllPlaces : left, count, first};
  small ? splat_small(samples, frame, tie_mm, tile) : splat_large(samples, frame, tie_mm, tile);
}

}  // namespace organbake
