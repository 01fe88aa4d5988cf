// SPDX-License-Identifier: Apache-2.0
#include "warp/landing.h"

#include <cmath>

#include "warp/left_pack.h"

namespace organbake {
namespace {

constexpr Landed::Numbers kAllSamples = [] {
  Landed::Numbers all{};
  for (std::uint32_t i = 0; i < kChunk; ++i) all[i] = i;
  return all;
}();

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

// Moves the samples that touch the tile together.
void compact(Landed& landed) {
  landed.left = kAllSamples;
  landed.sample = &landed.left;
  int kept = 0;
  for (std::uint32_t i = 0; i < kChunk; i += 8) {
    const LeftPack packed(lanes_unlike(&landed.inside[i], 0));
    packed(&landed.u[i], &landed.u[kept]);
    packed(&landed.v[i], &landed.v[kept]);
    packed(&landed.z[i], &landed.z[kept]);
    packed(&landed.cell[i], &landed.cell[kept]);
    packed(&landed.left[i], &landed.left[kept]);
    kept += packed.count();
  }
  landed.count = kept;
}

// Whether moving the inner samples together is not worth it: those outside are placed beyond the
// tile's border, in its guard band, and what they bring there is never looked at.
bool mostly_within(const PixelBox& box, const PixelBox& tile) {
  const PixelBox part = intersected(box, tile);
  return 5 * part.width() * part.height() > 3 * box.width() * box.height();
}

}  // namespace

void land_chunk(const SampleSet& set, std::uint32_t chunk, const ChunkFrame& frame,
                const FaceFrame& face, float near_mm, const TileKeys& tile, const CellGrid& cells,
                Landed& landed) {
  const std::size_t first = std::size_t{chunk} * kChunk;
  const Placement at = placement(frame, tile, cells);
  const ShellColumns matrix = patch_matrix(face.pixel, set.chunks[chunk].patch);
  const Sampled sampled{set.b1.data() + first, set.b2.data() + first, set.h.data() + first};
  landed.count = static_cast<int>(set.chunks[chunk].count);
  landed.sample = &kAllSamples;
  if (frame.uncut && mostly_within(frame.box, tile.box))
    return land_uncut(sampled, matrix, frame, at, landed);
  land_cut(sampled, landed.count, matrix, frame, at, near_mm, landed);
  compact(landed);
}

}  // namespace organbake
