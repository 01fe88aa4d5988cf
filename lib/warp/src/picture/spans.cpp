// SPDX-License-Identifier: Apache-2.0
// A span's sums as sRGB bytes, and its depths as levels.
#include "picture/spans.h"

#include <cstring>
#include <limits>

namespace organbake {
namespace {

// 255 × sRGB of linear light in 0…1. The curve's upper branch is a polynomial in the square root,
// fitted for the least largest error: 0.083 of a level.
inline float encoded(float linear) {
  const float s = std::sqrt(linear);
  const float upper =
      -10.2279639f +
      s * (387.07763f +
           s * (-357.698542f + s * (518.053022f + s * (-414.034189f + s * 131.912605f))));
  const float value = linear < 0.0031308f ? 255 * 12.92f * linear : upper;
  return value < 255 ? value : 255;
}

// Whole pixels in 32 bits each to three bytes each. A fourth byte is written, too: the next pixel's
// go over it.
void pack_rgb(const std::int32_t* pixels, int count, std::uint8_t* rgb) {
  for (int i = 0; i + 1 < count; ++i) std::memcpy(rgb + 3 * i, &pixels[i], sizeof pixels[i]);
  std::memcpy(rgb + 3 * (count - 1), &pixels[count - 1], 3);
}

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

ORGANBAKE_MULTIVERSION void encode(const SumSpan& sum, int count,
                                   const std::array<std::uint8_t, 3>& background,
                                   std::uint8_t* __restrict rgb, Cover* __restrict cover) {
  alignas(64) std::int32_t level[3][kSpan];
  alignas(64) float scale[kSpan];
  alignas(64) Cover covered[kSpan];
  const unsigned padded = whole_vectors(count);
  for (unsigned i = 0; i < padded; ++i) {
    scale[i] = 1 / (kFullScale * (sum.weight[i] > 0 ? sum.weight[i] : 1.0f));
  }
  const float* const planes[3] = {sum.red, sum.green, sum.blue};
  for (int k = 0; k < 3; ++k) {
    const float* __restrict color = planes[k];
    std::int32_t* __restrict out = level[k];
    const std::int32_t behind = background[k];
    for (unsigned i = 0; i < padded; ++i) {
      const auto shown = static_cast<std::int32_t>(encoded(color[i] * scale[i]) + 0.5f);
      out[i] = sum.weight[i] > 0 ? shown : behind;
    }
  }
  for (unsigned i = 0; i < padded; ++i) level[0][i] |= level[1][i] << 8 | level[2][i] << 16;
  pack_rgb(level[0], count, rgb);
  for (unsigned i = 0; i < padded; ++i) {
    covered[i] = sum.weight[i] > 0 ? Cover::samples : Cover::background;
  }
  std::copy_n(covered, count, cover);
}

void SkinDepth::resize(int width, int height, float reach_mm) {
  level_mm_ = reach_mm / kFarthest;
  if (width == width_ && height == height_) return;
  width_ = width, height_ = height;
  levels_.assign(std::size_t(stride()) * (height + 2 * kMargin), kNothing);
}

SkinDepth SkinDepth::of(const std::vector<float>& depth_mm, int width, float reach_mm) {
  for (const float depth : depth_mm)
    if (std::isfinite(depth)) reach_mm = std::max(reach_mm, depth);
  SkinDepth of;
  of.resize(width, static_cast<int>(depth_mm.size()) / width, reach_mm);
  std::vector<float> row(whole_vectors(width));
  for (int y = 0; y < of.height(); ++y) {
    std::copy_n(&depth_mm[std::size_t(y) * width], width, row.begin());
    of.put(0, y, width, row.data());
  }
  return of;
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
