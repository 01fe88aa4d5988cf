// SPDX-License-Identifier: Apache-2.0
#include "warp/lit_stretch.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace organbake {
namespace {

constexpr int kGroup = LitStretch::kGroup, kMiddle = 4;

// Neighbours whose depths differ by more texels than this lie beside a break, or on skin that is
// seen at a grazing angle.
constexpr float kSmoothTexels = 4;

// A group's numbers from those of its first, middle and last pixel, linear between them.
void mix_group(float* group) {
  alignas(32) static constexpr float kFirstHalf[kGroup] = {0, 0.25f, 0.5f, 0.75f, 1, 1, 1, 1};
  alignas(32) static constexpr float kSecondHalf[kGroup] = {0, 0, 0, 0, 0, 1 / 3.0f, 2 / 3.0f, 1};
  const float first = group[0], rise = group[kMiddle] - first;
  const float second_rise = group[kGroup - 1] - group[kMiddle];
  for (int i = 0; i < kGroup; ++i)
    group[i] = first + kFirstHalf[i] * rise + kSecondHalf[i] * second_rise;
}

}  // namespace

LitStretch::LitStretch(const float* depth_mm, int count, float texel_mm) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const float smooth_mm = kSmoothTexels * texel_mm;
  std::array<std::uint8_t, kStretch> runs_on;  // to the next pixel; not where either is +inf
  for (int i = 0; i + 1 < count; ++i)
    runs_on[i] = std::abs(depth_mm[i + 1] - depth_mm[i]) <= smooth_mm;
  for (int first = 0; first < count; first += kGroup) {
    const int end = std::min(first + kGroup, count);
    int together = 1;
    for (int i = first; i + 1 < end; ++i) together += runs_on[i];
    smooth_[first / kGroup] = together == kGroup;
    if (together == kGroup) {
      for (const int at : {0, kMiddle, kGroup - 1}) posts_[post_count_++] = first + at;
      continue;
    }
    for (int i = first; i < end; ++i) {
      posts_[post_count_] = i;
      post_count_ += depth_mm[i] < kInfinity;
    }
  }
}

void LitStretch::mix(float* plane) const {
  for (std::size_t g = 0; g < smooth_.size(); ++g)
    if (smooth_[g]) mix_group(plane + g * kGroup);
}

}  // namespace organbake
