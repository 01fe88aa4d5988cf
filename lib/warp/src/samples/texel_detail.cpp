// SPDX-License-Identifier: Apache-2.0
// The finer content of a map's texels, packed into words: colour, and what it becomes at their
// corners by neighbours on the same surface; and slopes of the depth. Rows are worked on as far as
// they have skin, five at a time, by loops that become vector code.
#include "samples/samples.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

// Beyond this many texel sizes of depth from one texel to the next (80.5° from facing) two texels
// count as two surfaces: their colours are not mixed.
constexpr float kSteepestTexels = 6;

using Words = std::vector<std::int16_t>;  // numbers of 16 bits: sixteen at once

inline std::uint32_t byte_of(float value) {  // 0…255
  const float positive = value > 0 ? value : 0;
  return static_cast<std::uint32_t>(
      static_cast<std::int32_t>((positive < 255 ? positive : 255) + 0.5f));
}

// Some columns of a row of a map in the samples' units, with a texel of nothing at either end.
struct MapRow {
  std::array<Words, 3> color;  // square-root light
  // In eighths of that, by how much more than the mean of its neighbours a texel is: between texels
  // their mean then is that of a cubic through the next ones, too (−1, 9, 9, −1)/16.
  std::array<Words, 3> sharp;
  Words confidence, shows;  // shows: 1 where there is a surface to look at
  std::vector<float> depth;
  // By neighbour, from the upper left one on, row by row: 1 where it goes on with the surface.
  std::array<Words, 9> joined;
  enum Neighbour : int { up = 1, left = 3, right = 5, down = 7 };

  explicit MapRow(int width) : confidence(width + 2), shows(width + 2), depth(width + 2) {
    for (int c = 0; c < 3; ++c) color[c].resize(width + 2), sharp[c].resize(width + 2);
    for (Words& neighbour : joined) neighbour.resize(width);
  }
  int width() const { return static_cast<int>(joined[0].size()); }
  // own: by texel of the map its colour and confidence, a byte each.
  void load(const CameraMaps& maps, const std::uint32_t* own, int x0, int y);
  void look_round(const MapRow& above, const MapRow& below, float steepest);
};

void MapRow::load(const CameraMaps& maps, const std::uint32_t* own, int x0, int y) {
  std::fill(shows.begin(), shows.end(), std::int16_t{0});
  if (y < 0 || y >= maps.height) return;
  const std::size_t first = std::size_t(y) * maps.width + x0;
  const std::uint32_t *const words = &own[first], *const slot = &maps.face[first];
  const auto word = [&](int x) { return slot[x] != kNoFace ? words[x] : 0; };  // else any
  for (int k = 0; k < 3; ++k)
    for (int x = 0; x < width(); ++x)
      color[k][x + 1] = static_cast<std::int16_t>(word(x) >> (8 * k) & 255);
  for (int x = 0; x < width(); ++x) confidence[x + 1] = static_cast<std::int16_t>(word(x) >> 24);
  for (int x = 0; x < width(); ++x) shows[x + 1] = slot[x] != kNoFace;
  std::copy_n(&maps.depth_mm[first], width(), depth.data() + 1);
}

// Whether `there` continues the surface of `here`.
void join(const float* __restrict here, const float* there, const std::int16_t* __restrict shows,
          float steepest, int width, std::int16_t* __restrict joined) {
  for (int x = 0; x < width; ++x)
    joined[x] = shows[x] & std::int16_t{std::abs(here[x] - there[x]) <= steepest * here[x]};
}

void MapRow::look_round(const MapRow& above, const MapRow& below, float steepest) {
  const std::array<const MapRow*, 3> rows = {&above, this, &below};
  for (const int k : {0, 1, 2, 3, 5, 6, 7, 8})
    join(depth.data() + 1, rows[k / 3]->depth.data() + k % 3, rows[k / 3]->shows.data() + k % 3,
         steepest, width(), joined[k].data());
  const std::int16_t *const l = joined[left].data(), *const r = joined[right].data(),
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

// The mean of the texels that meet at corner k of a texel and go on with its surface: of those in
// its own row and the one `beyond`; in the last byte what the corner carries of the texel's `own`.
void mix_corner(const MapRow& here, const MapRow& beyond, int k, const Words& own,
                std::uint32_t* __restrict out) {
  const int aside = k % 2 ? 1 : -1, row = k < 2 ? 0 : 6;
  const std::int16_t *const beside = here.joined[4 + aside].data(),
                            *const past = here.joined[row + 1].data(),
                            *const across = here.joined[row + 1 + aside].data();
  for (int x = 0; x < here.width(); ++x) {
    const auto count = static_cast<std::int16_t>(1 + beside[x] + past[x] + across[x]);
    // 2^16 by 8 count, rounded up: for sums of four bytes the quotient's whole part is right.
    const auto share = static_cast<std::uint16_t>(count == 1   ? 8192
                                                  : count == 2 ? 4096
                                                  : count == 3 ? 2731
                                                               : 2048);
    const auto mean = [&](const Words& near, const Words& far) {
      const auto sum = static_cast<std::int16_t>(near[x + 1] + beside[x] * near[x + 1 + aside] +
                                                 past[x] * far[x + 1] +
                                                 across[x] * far[x + 1 + aside] + 4 * count);
      const auto positive = static_cast<std::uint16_t>(sum > 0 ? sum : 0);
      const auto whole = static_cast<std::uint16_t>(std::uint32_t{positive} * share >> 16);
      return std::uint32_t{whole < 255 ? whole : std::uint16_t{255}};
    };
    out[x] = mean(here.sharp[0], beyond.sharp[0]) | mean(here.sharp[1], beyond.sharp[1]) << 8 |
             mean(here.sharp[2], beyond.sharp[2]) << 16 | std::uint32_t(own[x + 1]) << 24;
  }
}

void slopes(const float* __restrict before, const float* __restrict here,
            const float* __restrict after, const std::int16_t* __restrict has_before,
            const std::int16_t* __restrict has_after, int width, float* __restrict slope) {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  for (int x = 0; x < width; ++x) {
    const float in = here[x] - before[x], out = after[x] - here[x];
    const float one = has_before[x] ? in : has_after[x] ? out : kNone;
    slope[x] = has_before[x] & has_after[x] ? 0.5f * (in + out) : one;
  }
}

// Between which columns some rows have skin.
std::array<int, 2> columns_in_use(const CameraMaps& maps, int begin, int end) {
  constexpr int kOnce = 8;
  const auto none = [](const std::uint32_t* eight) {
    std::array<std::uint64_t, kOnce / 2> pairs;
    std::memcpy(pairs.data(), eight, sizeof pairs);
    return (pairs[0] & pairs[1] & pairs[2] & pairs[3]) == ~std::uint64_t{0};
  };
  int x0 = maps.width, x1 = 0;
  for (int y = std::max(begin, 0); y < std::min(end, maps.height); ++y) {
    const std::uint32_t* const face = &maps.face[std::size_t(y) * maps.width];
    int first = 0, last = maps.width;
    while (first + kOnce <= x0 && none(face + first)) first += kOnce;
    while (first < x0 && face[first] == kNoFace) ++first;
    while (last - kOnce >= x1 && none(face + last - kOnce)) last -= kOnce;
    while (last > x1 && face[last - 1] == kNoFace) --last;
    x0 = std::min(x0, first), x1 = std::max(x1, last);
  }
  return x0 < x1 ? std::array{x0, x1} : std::array{0, 0};
}

// By texel its colour in the samples' units and its confidence, a byte each: those between a row's
// first and last with skin. The maps give them up.
std::unique_ptr<std::uint32_t[]> own_words(CameraMaps& maps) {
  auto words = std::make_unique_for_overwrite<std::uint32_t[]>(maps.face.size());
  const auto root = [](float linear) { return byte_of(255 * std::sqrt(linear > 0 ? linear : 0)); };
  for (int y = 0; y < maps.height; ++y) {
    const auto [x0, x1] = columns_in_use(maps, y, y + 1);
    const std::size_t row = std::size_t(y) * maps.width;
    for (std::size_t i = row + x0; i < row + x1; ++i) {
      const Eigen::Vector3f& color = maps.color[i];
      words[i] = root(color[0]) | root(color[1]) << 8 | root(color[2]) << 16 |
                 byte_of(255 * maps.confidence[i]) << 24;
    }
  }
  maps.color = decltype(maps.color)();
  maps.confidence = decltype(maps.confidence)();
  return words;
}

}  // namespace

MapDetail::MapDetail(CameraMaps& maps, double focal_px, std::size_t slots) {
  const std::unique_ptr<std::uint32_t[]> own = own_words(maps);
  colors.resize(slots);
  slope_u = std::make_unique_for_overwrite<float[]>(slots);
  slope_v = std::make_unique_for_overwrite<float[]>(slots);
  const float steepest = kSteepestTexels / static_cast<float>(focal_px);
  constexpr int kRows = 64, kReach = 2;  // of a task; how far a texel's colours look
  parallel_pieces(0, maps.height, kRows, [&](int begin, int end) {
    const auto [x0, x1] = columns_in_use(maps, begin - kReach, end + kReach);
    const int width = x1 - x0;
    std::vector<MapRow> memory(2 * kReach + 1, MapRow(width));
    std::array<MapRow*, 2 * kReach + 1> rows;  // slide down: y − 2 … y + 2
    std::transform(memory.begin(), memory.end(), rows.begin(), [](MapRow& row) { return &row; });
    std::array<std::vector<std::uint32_t>, 4> corners;
    corners.fill(std::vector<std::uint32_t>(width));
    std::vector<float> along_u(width), along_v(width);
    for (int y = begin - 2 * kReach; y < end; ++y) {
      std::rotate(rows.begin(), rows.begin() + 1, rows.end());
      rows[4]->load(maps, own.get(), x0, y + kReach);
      rows[3]->look_round(*rows[2], *rows[4], steepest);
      if (y < begin) continue;
      const MapRow &above = *rows[1], &here = *rows[2], &below = *rows[3];
      for (int k = 0; k < 4; ++k)
        mix_corner(here, k < 2 ? above : below, k, k < 3 ? here.color[k] : here.confidence,
                   corners[k].data());
      const float* const z = here.depth.data() + 1;
      slopes(z - 1, z, z + 1, here.joined[MapRow::left].data(), here.joined[MapRow::right].data(),
             width, along_u.data());
      slopes(above.depth.data() + 1, z, below.depth.data() + 1, here.joined[MapRow::up].data(),
             here.joined[MapRow::down].data(), width, along_v.data());
      const std::uint32_t* const slots_of = &maps.face[std::size_t(y) * maps.width + x0];
      TexelColors* const to = colors.data();
      float *const to_u = slope_u.get(), *const to_v = slope_v.get();
      const std::uint32_t *const c0 = corners[0].data(), *const c1 = corners[1].data(),
                                 *const c2 = corners[2].data(), *const c3 = corners[3].data();
      for (int x = 0; x < width; ++x) {
        const std::uint32_t slot = slots_of[x];
        if (slot == kNoFace) continue;
        to[slot] = {c0[x], c1[x], c2[x], c3[x]};
        to_u[slot] = along_u[x], to_v[slot] = along_v[x];
      }
    }
  });
}

}  // namespace organbake
