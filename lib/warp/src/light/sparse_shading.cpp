// SPDX-License-Identifier: Apache-2.0
// Which pixels of a span light is worked out for, and how it is mixed between them.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "light/skin_light.h"

namespace organbake {
namespace {

constexpr int kRow = SparseShading::kGroup;

constexpr std::array kKnots = {0, 5, 10, kRow - 1};  // of a row of a group that runs on

// Neighbours whose depths differ by more texels than this lie beside a break, or on skin that is
// seen at a grazing angle. Rows are mixed over three of them, so that less may lie between two; and
// a row's end that bends away by more is not its skin's.
constexpr float kSmoothTexels = 4, kSmoothDownTexels = 2, kBendTexels = 1;

// How far each pixel of a group lies from knot k to the next.
constexpr std::array<float, kRow> way_on(std::size_t k) {
  std::array<float, kRow> ways{};
  for (int i = 0; i < kRow; ++i)
    ways[i] = std::clamp(float(i - kKnots[k]) / float(kKnots[k + 1] - kKnots[k]), 0.0f, 1.0f);
  return ways;
}

// A row of a group from its knots, linear between them.
inline void mix_row(const float* at, float* __restrict row) {
  static constexpr std::array kWays = {way_on(0), way_on(1), way_on(2)};
  const float first = at[0], second = at[1] - first, third = at[2] - at[1], last = at[3] - at[2];
  // Unrolled before it becomes a vector, its weights would be worked with one by one.
#pragma GCC unroll 1
  for (int i = 0; i < kRow; ++i)
    row[i] = first + kWays[0][i] * second + kWays[1][i] * third + kWays[2][i] * last;
}

// A row of a group that lies so far of the way from the first to the last.
inline void mix_between(const float* __restrict first, const float* __restrict last, float way,
                        float* __restrict row) {
#pragma GCC unroll 1
  for (int i = 0; i < kRow; ++i) row[i] = first[i] + way * (last[i] - first[i]);
}

// Whether all pixels of a group run on to the next, the last wherever it goes.
inline bool all_run_on(const std::uint8_t* runs_on) {
  constexpr std::uint8_t kAll[] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
  static_assert(sizeof kAll == kRow - 1);
  return std::memcmp(runs_on, kAll, sizeof kAll) == 0;
}

// Whether the knots at a row's ends lie on its skin. Beside an outline the last pixel alone may
// fall away: five would take its light, and step to their own when the outline moves on.
inline bool ends_run_on(const float* row_mm, float most_mm) {
  const auto bends = [&](int i) { return std::abs(row_mm[i - 1] - 2 * row_mm[i] + row_mm[i + 1]); };
  return bends(1) <= most_mm && bends(kRow - 2) <= most_mm;
}

// Whether the light of a row's knots turns so much at one of them that what lies between may be
// another: across a crease, which would step along with the knots.
inline bool light_bends(const float* at) {
  constexpr float kMostBend = 0.25f;  // of full exposure, on what is white
  return std::max(std::abs(at[0] - 2 * at[1] + at[2]), std::abs(at[1] - 2 * at[2] + at[3])) >
         kMostBend;
}

}  // namespace

SparseShading::SparseShading(const Rows& depth_mm, int rows, int count, float texel_mm)
    : depth_mm_(depth_mm), rows_(rows), count_(count) {
  const float smooth_mm = kSmoothTexels * texel_mm, down_mm = kSmoothDownTexels * texel_mm;
  // To the next pixel, and the next row's; not where either is +inf.
  alignas(64) std::array<std::array<std::uint8_t, kSpan>, kSpanRows> along;
  alignas(64) std::array<std::uint8_t, kSpan> down;
  down.fill(rows == kSpanRows);
  for (int r = 0; r < rows; ++r) {
    const auto& own = depth_mm[r];
    for (int i = 0; i + 1 < count; ++i) along[r][i] = std::abs(own[i + 1] - own[i]) <= smooth_mm;
    if (r == 0) continue;
    for (int i = 0; i < count; ++i) down[i] &= std::abs(own[i] - depth_mm[r - 1][i]) <= down_mm;
  }
  for (int g = 0; g < groups(); ++g) {
    const int first = g * kGroup;
    const bool whole = first + kGroup <= count;
    bool block = whole && all_run_on(&down[first]) && down[first + kGroup - 1];
    kinds_[g].fill(Kind::by_pixel);
    for (int r = 0; whole && r < rows; ++r) {
      const bool row =
          all_run_on(&along[r][first]) && ends_run_on(&depth_mm[r][first], kBendTexels * texel_mm);
      if (row) kinds_[g][r] = Kind::row;
      block = block && row;
    }
    if (block) kinds_[g].fill(Kind::block);
  }
  place_knots();
}

void SparseShading::place_knots() {
  int knots = 0;
  for (int g = 0; g < groups(); ++g) {
    const int first = g * kGroup;
    const bool block = kinds_[g][0] == Kind::block;
    for (int r = 0; r < rows_; ++r) {
      first_knot_[g][r] = knots;
      if (block && r > 0 && r + 1 < rows_) continue;
      if (kinds_[g][r] != Kind::by_pixel) {
        for (const int at : kKnots) knots_[knots++] = r * kSpan + first + at;
        continue;
      }
      for (int i = first; i < std::min(first + kGroup, count_); ++i) {
        knots_[knots] = r * kSpan + i;
        knots += depth_mm_[r][i] < std::numeric_limits<float>::infinity();
      }
    }
    std::fill(first_knot_[g].begin() + rows_, first_knot_[g].end(), knots);
  }
  first_knot_[groups()].fill(knots);
}

bool SparseShading::refine(const float* light) {
  bool any = false;
  for (int g = 0; g < groups(); ++g) {
    const bool block = kinds_[g][0] == Kind::block;
    for (int r = 0; r < rows_; r += block ? kSpanRows - 1 : 1) {
      if (kinds_[g][r] == Kind::by_pixel || !light_bends(light + first_knot_[g][r])) continue;
      std::fill_n(kinds_[g].begin() + (block ? 0 : r), block ? rows_ : 1, Kind::by_pixel);
      any = true;
    }
  }
  if (any) place_knots();
  return any;
}

void SparseShading::mix(int g, const float* of_knots, float* __restrict group) const {
  const auto& first = first_knot_[g];
  if (kinds_[g][0] == Kind::block) {
    constexpr int kLast = kPixels - kGroup;
    mix_row(of_knots + first[0], group);
    mix_row(of_knots + first[kSpanRows - 1], group + kLast);
    for (int r = 1; r + 1 < kSpanRows; ++r) {
      const float way = static_cast<float>(r) * (1.0f / (kSpanRows - 1));
      mix_between(group, group + kLast, way, group + r * kGroup);
    }
    return;
  }
  for (int r = 0; r < kSpanRows; ++r) {
    float* const row = group + r * kGroup;
    if (kinds_[g][r] == Kind::row) {
      mix_row(of_knots + first[r], row);
      continue;
    }
    std::fill_n(row, kGroup, 0.f);
    const int last = r + 1 < kSpanRows ? first[r + 1] : first_knot_[g + 1][0];
    for (int k = first[r]; k < last; ++k)
      row[static_cast<unsigned>(knots_[k]) % kGroup] = of_knots[k];
  }
}

}  // namespace organbake
