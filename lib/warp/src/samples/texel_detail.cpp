// SPDX-License-Identifier: Apache-2.0
// The finer content of a map's texels, packed into words: colour and how it changes across the
// texel, from neighbours on the same surface, and slopes of the depth. Rows are worked on whole,
// three at a time, by loops that become vector code.
#include "samples/samples.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "organbake/core/parallel.h"

namespace organbake {
namespace {

// Beyond this many texel sizes of depth from one texel to the next (80.5° from facing) two texels
// count as two surfaces: their colours are not differenced.
constexpr float kSteepestTexels = 6;

using Bytes = std::vector<std::uint8_t>;

inline std::uint8_t coded(float share) {  // 0…1 to 0…255
  const float positive = share > 0 ? share : 0;
  return static_cast<std::uint8_t>(
      static_cast<std::int32_t>(255 * (positive < 1 ? positive : 1) + 0.5f));
}

// One row of a map in the samples' units, with a texel of nothing at either end.
struct MapRow {
  std::array<Bytes, 3> color;            // square-root light
  std::vector<std::int16_t> brightness;  // the channels' sum
  Bytes confidence, shows;               // shows: 1 where there is a surface to look at
  std::vector<float> depth;

  explicit MapRow(int width)
      : brightness(width + 2), confidence(width + 2), shows(width + 2), depth(width + 2) {
    for (Bytes& channel : color) channel.resize(width + 2);
  }
  void load(const CameraMaps& maps, int y);
};

void MapRow::load(const CameraMaps& maps, int y) {
  const int width = maps.width;
  std::fill(shows.begin(), shows.end(), std::uint8_t{0});
  if (y < 0 || y >= maps.height) return;
  const std::size_t first = std::size_t(y) * width;
  const Eigen::Vector3f* const from = &maps.color[first];
  for (int k = 0; k < 3; ++k) {
    std::uint8_t* const to = color[k].data() + 1;
    for (int x = 0; x < width; ++x) {
      const float linear = from[x][k] > 0 ? from[x][k] : 0;
      to[x] = coded(std::sqrt(linear));
    }
  }
  const std::uint8_t *const red = color[0].data(), *const green = color[1].data(),
                            *const blue = color[2].data();
  std::int16_t* const sum = brightness.data();
  for (int x = 1; x <= width; ++x) sum[x] = static_cast<std::int16_t>(red[x] + green[x] + blue[x]);
  std::copy_n(&maps.depth_mm[first], width, depth.data() + 1);
  const float* const sure = &maps.confidence[first];
  const std::uint32_t* const face = &maps.face[first];
  for (int x = 0; x < width; ++x) confidence[x + 1] = coded(sure[x]);
  for (int x = 0; x < width; ++x) shows[x + 1] = (face[x] != kNoFace) & (confidence[x + 1] > 0);
}

// Whether `there` continues the surface of `here`.
void join(const float* __restrict here, const float* __restrict there,
          const std::uint8_t* __restrict shows, float steepest, int width,
          std::uint8_t* __restrict joined) {
  for (int x = 0; x < width; ++x)
    joined[x] = shows[x] & (std::abs(here[x] - there[x]) <= steepest * here[x]);
}

inline std::int8_t to_int8(std::int16_t v) {
  return static_cast<std::int8_t>(v > 127 ? 127 : v < -127 ? -127 : v);
}
// A sixth of the value, rounded to the nearest.
inline std::int16_t sixth(std::int16_t v) {
  return static_cast<std::int16_t>((v * 10923 + (1 << 15)) >> 16);
}

// First difference and half the second difference of the brightness between a texel's neighbours:
// the parabola through all three where both are there, a straight line where one is. The rows hold
// three times the brightness.
void terms(const std::int16_t* __restrict before, const std::int16_t* __restrict here,
           const std::int16_t* __restrict after, const std::uint8_t* __restrict has_before,
           const std::uint8_t* __restrict has_after, int width, std::int8_t* __restrict first,
           std::int8_t* __restrict half_second) {
  for (int x = 0; x < width; ++x) {
    const auto in = static_cast<std::int16_t>((here[x] - before[x]) * has_before[x]);
    const auto out = static_cast<std::int16_t>((after[x] - here[x]) * has_after[x]);
    const auto sum = static_cast<std::int16_t>(in + out);
    const auto difference = static_cast<std::int16_t>(out - in);
    const bool both = has_before[x] & has_after[x];
    first[x] = to_int8(sixth(both ? sum : static_cast<std::int16_t>(2 * sum)));
    half_second[x] = to_int8(both ? sixth(difference) : std::int16_t{0});
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

// A row's masks and terms, before they are packed texel by texel.
struct RowTerms {
  Bytes left, right, up, down;
  std::vector<std::int8_t> along_u, along_v, curve_u, curve_v;

  explicit RowTerms(int width) : left(width), right(width), up(width), down(width) {
    for (auto* plane : {&along_u, &along_v, &curve_u, &curve_v}) plane->resize(width);
  }
  void make(const MapRow& above, const MapRow& here, const MapRow& below, float steepest);
  void pack(const MapRow& here, PackedDetail* __restrict out) const;
};

void RowTerms::make(const MapRow& above, const MapRow& here, const MapRow& below, float steepest) {
  const int width = static_cast<int>(left.size());
  const float* const z = here.depth.data() + 1;
  const std::uint8_t* const shows = here.shows.data() + 1;
  join(z, z - 1, shows - 1, steepest, width, left.data());
  join(z, z + 1, shows + 1, steepest, width, right.data());
  join(z, above.depth.data() + 1, above.shows.data() + 1, steepest, width, up.data());
  join(z, below.depth.data() + 1, below.shows.data() + 1, steepest, width, down.data());
  const std::int16_t* const c = here.brightness.data() + 1;
  terms(c - 1, c, c + 1, left.data(), right.data(), width, along_u.data(), curve_u.data());
  terms(above.brightness.data() + 1, c, below.brightness.data() + 1, up.data(), down.data(), width,
        along_v.data(), curve_v.data());
}

inline std::uint32_t word(std::uint8_t a, std::uint8_t b, std::uint8_t c, std::uint8_t d) {
  return a | std::uint32_t{b} << 8 | std::uint32_t{c} << 16 | std::uint32_t{d} << 24;
}

void RowTerms::pack(const MapRow& here, PackedDetail* __restrict out) const {
  const int width = static_cast<int>(left.size());
  const std::uint8_t *const red = here.color[0].data() + 1, *const green = here.color[1].data() + 1,
                            *const blue = here.color[2].data() + 1,
                            *const sure = here.confidence.data() + 1;
  const auto unsigned_bytes = [](const std::vector<std::int8_t>& plane) {
    return reinterpret_cast<const std::uint8_t*>(plane.data());
  };
  const std::uint8_t *const u = unsigned_bytes(along_u), *const v = unsigned_bytes(along_v),
                            *const uu = unsigned_bytes(curve_u),
                            *const vv = unsigned_bytes(curve_v);
  for (int x = 0; x < width; ++x) {
    out[x] = word(red[x], green[x], blue[x], sure[x]) |
             std::uint64_t{word(u[x], v[x], uu[x], vv[x])} << 32;
  }
}

// The mean of the texels that meet at one corner of a texel and go on with its surface.
std::uint32_t corner_color(const MapRow& here, const MapRow& beyond, int x, int beside,
                           float steepest) {
  std::array<int, 3> sum{};
  int count = 0;
  const auto add = [&](const MapRow& row, int at) {
    if (!row.shows[at] || !(std::abs(row.depth[at] - here.depth[x]) <= steepest * here.depth[x]))
      return;
    for (int c = 0; c < 3; ++c) sum[c] += row.color[c][at];
    ++count;
  };
  add(here, x), add(here, beside), add(beyond, x), add(beyond, beside);
  std::uint32_t color = 0;
  for (int c = 0; c < 3 && count > 0; ++c)
    color |= static_cast<std::uint32_t>((2 * sum[c] + count) / (2 * count)) << (8 * c);
  return color;
}

void pack_smooth(const std::array<MapRow, 3>& rows, float steepest, int width, SmoothDetail* out) {
  const auto& [above, here, below] = rows;
  for (int x = 1; x <= width; ++x) {
    if (!here.shows[x]) continue;
    SmoothDetail& detail = out[x - 1];
    for (const int k : {0, 1, 2, 3})
      detail[k] = corner_color(here, k < 2 ? above : below, x, k % 2 ? x + 1 : x - 1, steepest);
    for (int c = 0; c < 3; ++c) detail[c] |= std::uint32_t{here.color[c][x]} << 24;
    detail[3] |= std::uint32_t{here.confidence[x]} << 24;
  }
}

}  // namespace

MapDetail::MapDetail(const CameraMaps& maps, double focal_px, bool with_smooth)
    : texels(maps.depth_mm.size()),
      smooth(with_smooth ? texels.size() : 0),
      slope_u(texels.size()),
      slope_v(texels.size()) {
  const int width = maps.width;
  const float steepest = kSteepestTexels / static_cast<float>(focal_px);
  constexpr int kRows = 64;  // a task's
  parallel_pieces(0, maps.height, kRows, [&](int begin, int end) {
    std::array<MapRow, 3> rows{MapRow(width), MapRow(width), MapRow(width)};  // slides down
    RowTerms row_terms(width);
    rows[1].load(maps, begin - 1);
    rows[2].load(maps, begin);
    for (int y = begin; y < end; ++y) {
      std::rotate(rows.begin(), rows.begin() + 1, rows.end());
      rows[2].load(maps, y + 1);
      const auto& [above, here, below] = rows;
      row_terms.make(above, here, below, steepest);
      const std::size_t first = std::size_t(y) * width;
      row_terms.pack(here, &texels[first]);
      if (with_smooth) pack_smooth(rows, steepest, width, &smooth[first]);
      const float* const z = here.depth.data() + 1;
      slopes(z - 1, z, z + 1, row_terms.left.data(), row_terms.right.data(), width,
             &slope_u[first]);
      slopes(above.depth.data() + 1, z, below.depth.data() + 1, row_terms.up.data(),
             row_terms.down.data(), width, &slope_v[first]);
    }
  });
}

}  // namespace organbake
