// SPDX-License-Identifier: Apache-2.0
#include "drawing/landing.h"

#include <cmath>

#include "drawing/compaction.h"

namespace organbake {
namespace {

constexpr PlacedSamples::Numbers kAllSamples = [] {
  PlacedSamples::Numbers all{};
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

// Three streams of samples' places within their patch.
struct Sampled {
  const PatchCoordinate *b1, *b2, *h;
};

// The hot loop: 15 multiply-adds (24 where the face is bent) and a reciprocal per sample, then its
// first pixel. It runs over all slots of the chunk. Where the tile cuts the chunk, it tells which
// of its `count` samples are inside.
template <bool kCut, bool kBent>
[[gnu::always_inline]] inline void place(const Sampled& sampled, int count,
                                         const ShellColumns& matrix, const ChunkFrame& c,
                                         const Placement& at, float near_mm,
                                         PlacedSamples& __restrict out) {
  float m[3][9];
  for (int r = 0; r < 3; ++r) {
    for (int k = 0; k < 9; ++k) m[r][k] = matrix(r, k);
  }
  for (int i = 0; i < static_cast<int>(kChunk); ++i) {
    const float b1 = sampled.b1[i], b2 = sampled.b2[i], h = sampled.h[i];
    const auto coordinate = [&](int r) __attribute__((always_inline)) {
      const float flat =
          m[r][0] + b1 * m[r][1] + b2 * m[r][2] + h * (m[r][3] + b1 * m[r][4] + b2 * m[r][5]);
      if constexpr (!kBent) return flat;
      return flat + b1 * (b1 * m[r][6] + b2 * m[r][7]) + b2 * b2 * m[r][8];
    };
    const float x = coordinate(0), y = coordinate(1), z = coordinate(2);
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

ORGANBAKE_MULTIVERSION void place_cut(const Sampled& sampled, int count, const ShellColumns& matrix,
                                      const ChunkFrame& c, const Placement& at, float near_mm,
                                      PlacedSamples& __restrict out) {
  place<true, false>(sampled, count, matrix, c, at, near_mm, out);
}

// None at rest; a deep poke bends most faces.
ORGANBAKE_MULTIVERSION void place_cut_bent(const Sampled& sampled, int count,
                                           const ShellColumns& matrix, const ChunkFrame& c,
                                           const Placement& at, float near_mm,
                                           PlacedSamples& __restrict out) {
  place<true, true>(sampled, count, matrix, c, at, near_mm, out);
}

ORGANBAKE_MULTIVERSION void place_uncut(const Sampled& sampled, const ShellColumns& matrix,
                                        const ChunkFrame& c, const Placement& at,
                                        PlacedSamples& __restrict out) {
  place<false, false>(sampled, static_cast<int>(kChunk), matrix, c, at, 0, out);
}

ORGANBAKE_MULTIVERSION void place_uncut_bent(const Sampled& sampled, const ShellColumns& matrix,
                                             const ChunkFrame& c, const Placement& at,
                                             PlacedSamples& __restrict out) {
  place<false, true>(sampled, static_cast<int>(kChunk), matrix, c, at, 0, out);
}

// Moves the samples that touch the tile together.
void compact(PlacedSamples& placed) {
  placed.left = kAllSamples;
  placed.sample = &placed.left;
  int kept = 0;
  for (std::uint32_t i = 0; i < kChunk; i += 8) {
    const Compaction packed(lanes_unlike(&placed.inside[i], 0));
    packed(&placed.u[i], &placed.u[kept]);
    packed(&placed.v[i], &placed.v[kept]);
    packed(&placed.z[i], &placed.z[kept]);
    packed(&placed.cell[i], &placed.cell[kept]);
    packed(&placed.left[i], &placed.left[kept]);
    kept += packed.count();
  }
  placed.count = kept;
}

// Whether moving the inner samples together is not worth it: those outside are placed beyond the
// tile's border, in its guard band, and what they bring there is never looked at.
bool mostly_within(const PixelBox& box, const PixelBox& tile) {
  const PixelBox part = intersected(box, tile);
  return 5 * part.width() * part.height() > 3 * box.width() * box.height();
}

}  // namespace

void place_samples(const SampleSet& set, std::uint32_t chunk, const ChunkFrame& frame,
                   const FaceFrame& face, float near_mm, const TileKeys& tile,
                   const CellGrid& cells, PlacedSamples& placed) {
  const std::size_t first = std::size_t{chunk} * kChunk;
  const Placement at = placement(frame, tile, cells);
  const ShellColumns matrix = patch_matrix(face.pixel, set.chunks[chunk].patch);
  const Sampled sampled{set.b1.data() + first, set.b2.data() + first, set.h.data() + first};
  placed.count = static_cast<int>(set.chunks[chunk].count);
  placed.sample = &kAllSamples;
  if (frame.uncut && mostly_within(frame.box, tile.box))
    return (face.bent ? place_uncut_bent : place_uncut)(sampled, matrix, frame, at, placed);
  (face.bent ? place_cut_bent : place_cut)(sampled, placed.count, matrix, frame, at, near_mm,
                                           placed);
  compact(placed);
}

}  // namespace organbake
