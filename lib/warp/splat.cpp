// SPDX-License-Identifier: Apache-2.0
#include "warp/splat.h"

#include <algorithm>
#include <cmath>

#include "warp/left_pack.h"
#include "warp/wide.h"

namespace organbake {
namespace {

constexpr int kGuard = TileKeys::kGuard;
constexpr float kNowhere = 1e6f;  // reaches from its sample: nobody's, and a number that converts

// Where a chunk's samples land: offset from each sample to its first pixel's centre, depth, that
// pixel in the tile, and whether the splat touches the tile at all.
struct Landed {
  alignas(32) float u[kChunk], v[kChunk], z[kChunk];
  alignas(32) std::int32_t column[kChunk], row[kChunk];
  alignas(32) std::uint32_t inside[kChunk], slot[kChunk];
};

struct Placement {
  float left, top;  // half a splat and half a pixel, from the tile's corner
  float half_columns, half_rows;
  float low_x, low_y, high_x, high_y;  // first pixels that still touch the part
};

inline float lowest_of(float a, float b) { return a < b ? a : b; }
inline float highest_of(float a, float b) { return a > b ? a : b; }
// Smallest integer ≥ v for |v| < 2^30, in a form that vectorises without SSE's rounding flags.
inline std::int32_t ceil_int(float v) {
  const std::int32_t t = static_cast<std::int32_t>(v);
  return t + (static_cast<float>(t) < v ? 1 : 0);
}

// A face's matrix for one of its patches: from the samples' places instead of (b1, b2, h). The
// shell map's terms are the same, 1, b1, b2, h, h·b1 and h·b2.
struct PatchMatrix {
  float m[3][6];

  PatchMatrix(const float (&face)[3][6], const Patch& patch) {
    const auto [c1, c2, ch] = patch.center;
    const float e1 = patch.extent[0] / kFullPlace, e2 = patch.extent[1] / kFullPlace,
                eh = patch.extent[2] / kFullPlace;
    for (int r = 0; r < 3; ++r) {
      const auto& f = face[r];
      const float by_h = f[3] + c1 * f[4] + c2 * f[5];
      m[r][0] = f[0] + c1 * f[1] + c2 * f[2] + ch * by_h;
      m[r][1] = e1 * (f[1] + ch * f[4]);
      m[r][2] = e2 * (f[2] + ch * f[5]);
      m[r][3] = eh * by_h;
      m[r][4] = eh * e1 * f[4];
      m[r][5] = eh * e2 * f[5];
    }
  }
};

// The hot loop: 15 multiply-adds and a reciprocal per sample, then its first pixel.
ORGANBAKE_WIDE void land(const Place* __restrict place1, const Place* __restrict place2,
                         const Place* __restrict place_h, int count, const float (&m)[3][6],
                         const ChunkFrame& c, const Placement& at, float near_mm,
                         Landed& __restrict out) {
  for (int i = 0; i < count; ++i) {
    const float b1 = place1[i], b2 = place2[i], h = place_h[i];
    const float x =
        m[0][0] + b1 * m[0][1] + b2 * m[0][2] + h * (m[0][3] + b1 * m[0][4] + b2 * m[0][5]);
    const float y =
        m[1][0] + b1 * m[1][1] + b2 * m[1][2] + h * (m[1][3] + b1 * m[1][4] + b2 * m[1][5]);
    const float z =
        m[2][0] + b1 * m[2][1] + b2 * m[2][2] + h * (m[2][3] + b1 * m[2][4] + b2 * m[2][5]);
    const float inverse = 1 / highest_of(z, near_mm);
    // Clamped one step beyond what is accepted, which also keeps the conversions defined.
    const float s = lowest_of(highest_of(x * inverse - at.left, at.low_x - 1), at.high_x + 1);
    const float t = lowest_of(highest_of(y * inverse - at.top, at.low_y - 1), at.high_y + 1);
    const std::int32_t column = ceil_int(s), row = ceil_int(t);
    const float dx = static_cast<float>(column) - s - at.half_columns;
    const float dy = static_cast<float>(row) - t - at.half_rows;
    out.u[i] = c.u_x * dx + c.u_y * dy;
    out.v[i] = c.v_x * dx + c.v_y * dy;
    out.z[i] = z;
    out.column[i] = column;
    out.row[i] = row;
    out.inside[i] = (z > near_mm) & (s > at.low_x - 1) & (s <= at.high_x) & (t > at.low_y - 1) &
                    (t <= at.high_y);
  }
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
  alignas(32) std::array<std::uint32_t, kChunk> low, high;
  alignas(32) std::array<std::int32_t, kChunk> cell;
};
struct PackedBids {
  alignas(32) std::array<std::uint64_t, kChunk> key;
  alignas(32) std::array<std::int32_t, kChunk> cell;
};

// Bids of all samples for the pixel (du, dv) beyond their first one.
ORGANBAKE_WIDE void make_bids(const Landed& __restrict in, int count, float du, float dv,
                              const ChunkFrame& c, float tie_mm, Bids& __restrict bids) {
  for (int i = 0; i < count; ++i) {
    const Key key = make_key(in.u[i] + du, in.v[i] + dv, in.z[i], c, tie_mm, in.slot[i]);
    bids.low[i] = key.low;
    bids.high[i] = key.high;
  }
}

// Of two to four pixels that a splat tries, its sample stands for about one. Moves those bids
// together and returns how many they are.
int pack(const Bids& in, int count, PackedBids& out) {
  int kept = 0;
  for (int i = 0; i < count; i += 8) {
    const LeftPack packed(lanes_unlike(&in.high[i], kEmptyHigh));
    packed(&in.low[i], &in.high[i], &out.key[kept]);
    packed(&in.cell[i], &out.cell[kept]);
    kept += packed.count();
  }
  return kept;
}

// Moves the samples that touch the tile together; returns how many they are.
int compact(Landed& landed, int count) {
  int kept = 0;
  for (int i = 0; i < count; i += 8) {
    const LeftPack packed(lanes_unlike(landed.inside + i, 0));
    packed(landed.u + i, landed.u + kept);
    packed(landed.v + i, landed.v + kept);
    packed(landed.z + i, landed.z + kept);
    packed(landed.column + i, landed.column + kept);
    packed(landed.row + i, landed.row + kept);
    packed(landed.slot + i, landed.slot + kept);
    kept += packed.count();
  }
  return kept;
}

Placement placement(const ChunkFrame& c, const TileKeys& tile, int slack_columns, int slack_rows) {
  const float half_columns = 0.5f * static_cast<float>(c.columns);
  const float half_rows = 0.5f * static_cast<float>(c.rows);
  const int x0 = tile.box.x0 - tile.origin_x, y0 = tile.box.y0 - tile.origin_y;
  return {.left = half_columns + 0.5f + static_cast<float>(tile.origin_x),
          .top = half_rows + 0.5f + static_cast<float>(tile.origin_y),
          .half_columns = half_columns,
          .half_rows = half_rows,
          .low_x = static_cast<float>(x0 - slack_columns),
          .low_y = static_cast<float>(y0 - slack_rows),
          .high_x = static_cast<float>(x0 + tile.box.width() - 1),
          .high_y = static_cast<float>(y0 + tile.box.height() - 1)};
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
void splat_small(Landed& landed, int count, const ChunkFrame& c, float tie_mm, TileKeys& tile) {
  const int padded = (count + 7) & ~7;  // whole vectors
  const int right = kGuard + tile.origin_x - tile.box.x0,
            down = kGuard + tile.origin_y - tile.box.y0;
  Bids bids;
  PackedBids own;
  for (int i = 0; i < padded; ++i) {
    bids.cell[i] = (landed.row[i] + down) * tile.stride + landed.column[i] + right;
  }
  for (int i = count; i < padded; ++i) landed.u[i] = kNowhere;
  for (int ty = 0; ty < c.rows; ++ty) {
    for (int tx = 0; tx < c.columns; ++tx) {
      if (!reaches(c, tx, ty)) continue;
      const float du = c.u_x * static_cast<float>(tx) + c.u_y * static_cast<float>(ty);
      const float dv = c.v_x * static_cast<float>(tx) + c.v_y * static_cast<float>(ty);
      make_bids(landed, padded, du, dv, c, tie_mm, bids);
      const int bidding = pack(bids, padded, own);
      std::uint64_t* const cells = tile.keys.data() + std::size_t(ty) * tile.stride + tx;
      for (int i = 0; i < bidding; ++i) {
        std::uint64_t& cell = cells[own.cell[i]];
        cell = own.key[i] < cell ? own.key[i] : cell;
      }
    }
  }
}

// Larger splats, seen from very near: sample after sample, clipped to the tile.
void splat_large(const Landed& landed, int count, const ChunkFrame& c, float tie_mm,
                 TileKeys& tile) {
  const int width = tile.box.width(), height = tile.box.height();
  for (int i = 0; i < count; ++i) {
    const int column = landed.column[i] + tile.origin_x - tile.box.x0;
    const int row = landed.row[i] + tile.origin_y - tile.box.y0;
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
        const std::uint64_t key = make_key(u, v, landed.z[i], c, tie_mm, landed.slot[i]).value();
        cells[tx] = std::min(cells[tx], key);
      }
    }
  }
}

// Sends for the colours that the tile's pixels will ask for in another order: they come while its
// samples are placed. A frame in a twentieth less time.
void send_for_detail(const SampleSet& set, std::uint32_t first) {
  constexpr std::uint32_t kLine = 64 / sizeof(PackedDetail);  // of a cache
  for (std::uint32_t i = 0; i < kChunk; i += kLine)
    __builtin_prefetch(set.detail.data() + first + i, 0, 2);
}

}  // namespace

void TileKeys::clear(const PixelBox& tile, const PixelBox& part) {
  box = part;
  origin_x = tile.x0, origin_y = tile.y0;
  stride = part.width() + 2 * kGuard;
  keys.assign(std::size_t(stride) * (part.height() + 2 * kGuard), kEmptyKey);
}

void splat_chunk(const SampleSet& set, std::uint32_t chunk, const ChunkFrame& frame,
                 const FaceFrame& face, float near_mm, float tie_mm, TileKeys& tile) {
  Landed landed;
  const std::uint32_t first = chunk * kChunk;
  int count = static_cast<int>(set.chunks[chunk].count);
  const Placement at = placement(frame, tile, frame.columns - 1, frame.rows - 1);
  send_for_detail(set, first);
  const PatchMatrix matrix(face.pixel, set.chunks[chunk].patch);
  // Whole vectors: slots beyond the last sample exist.
  land(set.b1.data() + first, set.b2.data() + first, set.h.data() + first, (count + 7) & ~7,
       matrix.m, frame, at, near_mm, landed);
  int inside = 0;
  for (int i = 0; i < count; ++i) inside += landed.inside[i];
  for (std::uint32_t i = 0; i < kChunk; ++i) landed.slot[i] = first + i;
  for (int i = count; i < ((count + 7) & ~7); ++i) landed.inside[i] = 0;
  if (inside < count) count = compact(landed, count);
  if (frame.columns <= kGuard && frame.rows <= kGuard) {
    splat_small(landed, count, frame, tie_mm, tile);
  } else {
    splat_large(landed, count, frame, tie_mm, tile);
  }
}

}  // namespace organbake
