// SPDX-License-Identifier: Apache-2.0
#include "light/skin_grain.h"

#include <algorithm>
#include <cmath>

#include "light/grain_table.h"
#include "picture/vector_loops.h"

namespace organbake {
namespace {

constexpr float kTone = 0.65f;  // of a share, the largest octave's deviation

// Where octave k of the grain looks a pixel up. Each octave has its axes in another order, a
// little askew, so that no two repeat together.
struct GrainPlaces {
  alignas(64) std::int32_t at[SkinGrain::kOctaves][kSpan];
  alignas(64) float value[SkinGrain::kOctaves][kSpan];
};

ORGANBAKE_MULTIVERSION void find_grain(const SkinVectors& p, float per_mm, int count,
                                       std::int32_t* __restrict at) {
  constexpr std::int32_t kMask = GrainTable::kSide - 1;
  constexpr int kBits = GrainTable::kBits;
  const auto whole = [](float v) { return static_cast<std::int32_t>(std::floor(v)) & kMask; };
  for (unsigned i = 0; i < whole_vectors(count); ++i) {
    const float x = per_mm * p.x[i], y = per_mm * p.y[i], z = per_mm * p.z[i];
    at[i] =
        whole(x + 0.31f * y) << (2 * kBits) | whole(y + 0.27f * z) << kBits | whole(z - 0.29f * x);
  }
}

ORGANBAKE_MULTIVERSION void multiply_by_grain(const GrainPlaces& grain, const float* depths,
                                              float grain_px, const std::array<float, 3>& shares,
                                              int count, const std::array<float*, 3>& planes) {
  float* __restrict red = planes[0], * __restrict green = planes[1], * __restrict blue = planes[2];
  constexpr float kPart = kTone / GrainTable::kDeviation, kLeast = 0.15f;
  ORGANBAKE_INDEPENDENT
  for (unsigned i = 0; i < whole_vectors(count); ++i) {
    const float px = grain_px / depths[i];
    const float a = resolved(px) * grain.value[0][i];
    const float b = resolved(px * SkinGrain::kOctaveStep) * grain.value[1][i];
    const float c =
        resolved(px * SkinGrain::kOctaveStep * SkinGrain::kOctaveStep) * grain.value[2][i];
    const float tone = kPart * (a + 0.9f * b + 0.7f * c), hue = kPart * 0.4f * (b - a);
    const auto times = [&](float share, float of_hue) {
      const float by = 1 + share * (tone + of_hue * hue);
      return by > kLeast ? by : kLeast;
    };
    red[i] *= times(shares[0], -0.5f);
    green[i] *= times(shares[1], 0.3f);
    blue[i] *= times(shares[2], 0.6f);
  }
}

}  // namespace

bool SkinGrain::shows(float depth_mm, float inverse_pixel) const {
  return grain_mm_ > 0 && resolved(grain_mm_ * inverse_pixel / depth_mm) > 0;
}

void SkinGrain::add(const ScopeSkin& skin, const ScopeSkinAtRest& at_rest, float inverse_pixel,
                    float nearest_mm, const SpanColors& colors) const {
  const std::int8_t* const table = GrainTable::shared().data();
  GrainPlaces grain;
  const SkinVectors place(at_rest.places_mm);
  const SkinVectors other = place.turned(), third = other.turned();
  float per_mm = GrainTable::kPerGrain / grain_mm_;
  const std::array<const SkinVectors*, kOctaves> places = {&place, &other, &third};
  const float grain_px = inverse_pixel * grain_mm_;
  float most_px = grain_px / nearest_mm;
  for (int k = 0; k < kOctaves; ++k, per_mm /= kOctaveStep, most_px *= kOctaveStep) {
    // What no pixel of the span shows needs not be looked up.
    if (resolved(most_px) <= 0) {
      std::fill_n(grain.value[k], kSpan, 0.f);
      continue;
    }
    find_grain(*places[k], per_mm, colors.count, grain.at[k]);
    for (unsigned i = 0; i < whole_vectors(colors.count); ++i)
      grain.value[k][i] = table[grain.at[k][i]];
  }
  multiply_by_grain(grain, skin.depth_mm, grain_px, shares_, colors.count, colors.planes);
}

}  // namespace organbake
