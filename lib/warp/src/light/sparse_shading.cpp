// SPDX-License-Identifier: Apache-2.0
#include "light/sparse_shading.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace organbake {
namespace {

constexpr int kGroup = SparseShading::kGroup, kMiddle = 4;

// Neighbours whose depths differ by more texels than this lie beside a break, or on skin that is
// seen at a grazing angle.
constexpr float kSmoothTexels = 4;

// A group's numbers from those of its first, middle and last pixel, linear between them.
inline void mix_group(float first, float middle, float last, float* __restrict group) {
  constexpr float kFirstHalf[kGroup] = {0, 0.25f, 0.5f, 0.75f, 1, 1, 1, 1};
  constexpr float kSecondHalf[kGroup] = {0, 0, 0, 0, 0, 1 / 3.0f, 2 / 3.0f, 1};
  // Unrolled before it becomes a vector, its weights would be worked with one by one.
#pragma GCC unroll 1
  for (int i = 0; i < kGroup; ++i)
    group[i] = first + kFirstHalf[i] * (middle - first) + kSecondHalf[i] * (last - middle);
}

// Whether all eight pixels of a group run on to the next, the last wherever it goes.
inline bool all_run_on(const std::uint8_t* runs_on) {
  static_assert(kGroup == 8);
  std::uint64_t bytes;
  std::memcpy(&bytes, runs_on, sizeof bytes);
  const std::uint8_t to_the_next[kGroup] = {1, 1, 1, 1, 1, 1, 1, 0};
  std::uint64_t wanted;
  std::memcpy(&wanted, to_the_next, sizeof wanted);
  return (bytes & wanted) == wanted;
}

}  // namespace

SparseShading::SparseShading(const float* depth_mm, int count, float texel_mm) : count_(count) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const float smooth_mm = kSmoothTexels * texel_mm;
  alignas(64) std::array<std::uint8_t, kSpan>
      runs_on;  // to the next pixel; not where either is +inf
  for (int i = 0; i + 1 < count; ++i)
    runs_on[i] = std::abs(depth_mm[i + 1] - depth_mm[i]) <= smooth_mm;
  for (int first = 0; first < count; first += kGroup) {
    smooth_[first / kGroup] = first + kGroup <= count && all_run_on(&runs_on[first]);
    if (smooth_[first / kGroup]) {
      for (const int at : {0, kMiddle, kGroup - 1}) knots_[post_count_++] = first + at;
      continue;
    }
    for (int i = first; i < std::min(first + kGroup, count); ++i) {
      knots_[post_count_] = i;
      post_count_ += depth_mm[i] < kInfinity;
    }
  }
}

ShadingInterpolation::ShadingInterpolation(const SparseShading& span, const std::int32_t* at,
                                           int count)
    : span_(span) {
  row_.fill(static_cast<std::int16_t>(count));
  for (int k = 0; k < count; ++k) row_[at[k]] = static_cast<std::int16_t>(k);
}

void ShadingInterpolation::operator()(const ShadedPosts& table,
                                      const std::array<float*, 3>& planes) const {
  const int groups = static_cast<int>(whole_vectors(span_.count())) / kGroup;
  for (int g = 0; g < groups; ++g) {
    const std::int16_t* const row = &row_[std::size_t(g) * kGroup];
    if (span_.smooth(g)) {
      const float *const begin = table.rows[row[0]], *const middle = table.rows[row[kMiddle]],
                         *const end = table.rows[row[kGroup - 1]];
      for (int c = 0; c < 3; ++c)
        mix_group(begin[c], middle[c], end[c], planes[c] + std::size_t(g) * kGroup);
      continue;
    }
    for (int i = 0; i < kGroup; ++i) {
      for (int c = 0; c < 3; ++c) planes[c][std::size_t(g) * kGroup + i] = table.rows[row[i]][c];
    }
  }
}

}  // namespace organbake
