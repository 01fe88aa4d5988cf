// SPDX-License-Identifier: Apache-2.0
// The finer content of a map's texels, packed into words: colour, and what it becomes at their
// corners by neighbours on the same surface; and slopes of the depth. Rows are worked on whole,
// five at a time, by loops that become vector code.
#include "samples/samples.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

// Beyond this many texel sizes of depth from one texel to the next (80.5° from facing) two texels
// count as two surfaces: their colours are not mixed.
constexpr float kSteepestTexels = 6;

using Bytes = std::vector<std::uint8_t>;
using Words = std::vector<std::int16_t>;

inline std::uint8_t byte_of(float value) {  // 0…255
  const float positive = value > 0 ? value : 0;
  return static_cast<std::uint8_t>(
      static_cast<std::int32_t>((positive < 255 ? positive : 255) + 0.5f));
}

// One row of a map in the samples' units, with a texel of nothing at either end.
struct MapRow {
  std::array<Words, 3> color;  // square-root light
  // In eighths of that, by how much more than the mean of its neighbours a texel is: between texels
  // their mean then is that of a cubic through the next ones, too (−1, 9, 9, −1)/16.
  std::array<Words, 3> sharp;
  Bytes confidence, shows;  // shows: 1 where there is a surface to look at
  std::vector<float> depth;
  // By neighbour, from the upper left one on, row by row: 1 where it goes on with the surface.
  std::array<Bytes, 9> joined;
  enum Neighbour : int { up = 1, left = 3, right = 5, down = 7 };

  explicit MapRow(int width) : confidence(width + 2), shows(width + 2), depth(width + 2) {
    for (int c = 0; c < 3; ++c) color[c].resize(width + 2), sharp[c].resize(width + 2);
    for (Bytes& neighbour : joined) neighbour.resize(width);
  }
  int width() const { return static_cast<int>(joined[0].size()); }
  void load(const CameraMaps& maps, int y);
  void look_round(const MapRow& above, const MapRow& below, float steepest);
};

void MapRow::load(const CameraMaps& maps, int y) {
  std::fill(shows.begin(), shows.end(), std::uint8_t{0});
  if (y < 0 || y >= maps.height) return;
  const std::size_t first = std::size_t(y) * maps.width;
  const Eigen::Vector3f* const from = &maps.color[first];
  for (int k = 0; k < 3; ++k) {
    std::int16_t* const to = color[k].data() + 1;
    for (int x = 0; x < width(); ++x) {
      const float linear = from[x][k] > 0 ? from[x][k] : 0;
      to[x] = byte_of(255 * std::sqrt(linear));
    }
  }
  std::copy_n(&maps.depth_mm[first], width(), depth.data() + 1);
  const float* const sure = &maps.confidence[first];
  const std::uint32_t* const face = &maps.face[first];
  for (int x = 0; x < width(); ++x) confidence[x + 1] = byte_of(255 * sure[x]);
  for (int x = 0; x < width(); ++x) shows[x + 1] = (face[x] != kNoFace) & (confidence[x + 1] > 0);
}

// Whether `there` continues the surface of `here`.
void join(const float* __restrict here, const float* there, const std::uint8_t* __restrict shows,
          float steepest, int width, std::uint8_t* __restrict joined) {
  for (int x = 0; x < width; ++x)
    joined[x] = shows[x] & (std::abs(here[x] - there[x]) <= steepest * here[x]);
}

void MapRow::look_round(const MapRow& above, const MapRow& below, float steepest) {
  const std::array<const MapRow*, 3> rows = {&above, this, &below};
  for (int k = 0; k < 9; ++k)
    join(depth.data() + 1, rows[k / 3]->depth.data() + k % 3, rows[k / 3]->shows.data() + k % 3,
         steepest, width(), joined[k].data());
  const std::uint8_t *const l = joined[left].data(), *const r = joined[right].data(),
                            *const u = joined[up].data(), *const d = joined[down].data();
  for (int c = 0; c < 3; ++c) {
    const std::int16_t *const here = color[c].data() + 1, *const before = above.color[c].data() + 1,
                              *const after = below.color[c].data() + 1;
    std::int16_t* __restrict out = sharp[c].data() + 1;
    for (int x = 0; x < width(); ++x) {
      const int across = (2 * here[x] - here[x - 1] - here[x + 1]) * (l[x] & r[x]);
      const int along = (2 * here[x] - before[x] - after[x]) * (u[x] & d[x]);
      out[x] = static_cast<std::int16_t>(8 * here[x] + across + along);
    }
  }
}

// The mean of the texels that meet at one corner of a texel and go on with its surface: of those in
// its own row and the one `beyond`, and `aside` of it.
void mix_corner(const std::int16_t* here, const std::int16_t* beyond, int aside,
                const std::uint8_t* __restrict has_beside,
                const std::uint8_t* __restrict has_beyond,
                const std::uint8_t* __restrict has_across, int width,
                std::uint8_t* __restrict out) {
  for (int x = 0; x < width; ++x) {
    const int sum = here[x] + has_beside[x] * here[x + aside] + has_beyond[x] * beyond[x] +
                    has_across[x] * beyond[x + aside];
    const int count = 1 + has_beside[x] + has_beyond[x] + has_across[x];
    out[x] = byte_of(static_cast<float>(sum) * 0.125f / static_cast<float>(count));
  }
}

// A row's colours, `scratch` three planes of it.
void pack_colors(const MapRow& above, const MapRow& here, const MapRow& below,
                 std::array<Bytes, 3>& scratch, TexelColors* __restrict out) {
  const int width = here.width();
  for (int k = 0; k < 4; ++k) {
    const MapRow& beyond = k < 2 ? above : below;
    const int aside = k % 2 ? 1 : -1, row = k < 2 ? 0 : 6;
    for (int c = 0; c < 3; ++c)
      mix_corner(here.sharp[c].data() + 1, beyond.sharp[c].data() + 1, aside,
                 here.joined[4 + aside].data(), here.joined[row + 1].data(),
                 here.joined[row + 1 + aside].data(), width, scratch[c].data());
    for (int x = 0; x < width; ++x) {
      const std::uint32_t own =
          k < 3 ? std::uint32_t(here.color[k][x + 1]) : here.confidence[x + 1];
      out[x][k] = scratch[0][x] | std::uint32_t{scratch[1][x]} << 8 |
                  std::uint32_t{scratch[2][x]} << 16 | own << 24;
    }
  }
}

void slopes(const float* __restrict before, const float* __restrict here,
            const float* __restrict after, const std::uint8_t* __restrict has_before,
            const std::uint8_t* __restrict has_after, int width, float* __restrict slope) {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  for (int x = 0; x < width; ++x) {
    const float in = here[x] - before[x], out = after[x] - here[x];
    const float one = has_before[x] ? in : has_after[x] ? out : kNone;
    slope[x] = has_before[x] & has_after[x] ? 0.5f * (in + out) : one;
  }
}

}  // namespace

MapDetail::MapDetail(const CameraMaps& maps, double focal_px)
    : colors(maps.depth_mm.size()), slope_u(colors.size()), slope_v(colors.size()) {
  const int width = maps.width;
  const float steepest = kSteepestTexels / static_cast<float>(focal_px);
  constexpr int kRows = 64;  // a task's
  parallel_pieces(0, maps.height, kRows, [&](int begin, int end) {
    std::vector<MapRow> rows(5, MapRow(width));  // slides down: y − 2 … y + 2
    std::array<Bytes, 3> scratch;
    scratch.fill(Bytes(width));
    for (int y = begin - 4; y < end; ++y) {
      std::rotate(rows.begin(), rows.begin() + 1, rows.end());
      rows[4].load(maps, y + 2);
      rows[3].look_round(rows[2], rows[4], steepest);
      if (y < begin) continue;
      const MapRow &above = rows[1], &here = rows[2], &below = rows[3];
      const std::size_t first = std::size_t(y) * width;
      pack_colors(above, here, below, scratch, &colors[first]);
      const float* const z = here.depth.data() + 1;
      slopes(z - 1, z, z + 1, here.joined[MapRow::left].data(), here.joined[MapRow::right].data(),
             width, &slope_u[first]);
      slopes(above.depth.data() + 1, z, below.depth.data() + 1, here.joined[MapRow::up].data(),
             here.joined[MapRow::down].data(), width, &slope_v[first]);
    }
  });
}

}  // namespace organbake
