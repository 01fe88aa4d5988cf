// SPDX-License-Identifier: Apache-2.0
#include "picture/skin_depth.h"

#include <array>
#include <limits>

#include "picture/sum_span.h"

namespace organbake {
namespace {

ORGANBAKE_MULTIVERSION void to_levels(const float* __restrict depth_mm, int count, float per_mm,
                                      SkinDepth::Level* __restrict levels) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr float kFarthest = SkinDepth::kFarthest, kNothing = SkinDepth::kNothing;
  for (unsigned i = 0; i < whole_vectors(count); ++i) {
    const float level = depth_mm[i] * per_mm;
    const float capped = level < kFarthest ? level : kFarthest;
    levels[i] = static_cast<SkinDepth::Level>(
        static_cast<std::int32_t>(depth_mm[i] < kInfinity ? capped : kNothing));
  }
}

}  // namespace

void SkinDepth::resize(int width, int height, float reach_mm) {
  level_mm_ = reach_mm / kFarthest;
  if (width == width_ && height == height_) return;
  width_ = width, height_ = height;
  levels_.assign(std::size_t(stride()) * (height + 2 * kMargin), kNothing);
}

void SkinDepth::put(int x, int y, int count, const float* depth_mm) {
  alignas(64) std::array<Level, kSpan> levels;
  for (int done = 0; done < count; done += kSpan) {
    const int now = std::min(kSpan, count - done);
    to_levels(depth_mm + done, now, 1 / level_mm_, levels.data());
    std::copy_n(levels.data(), now, at(x + done, y));
  }
}

}  // namespace organbake
