// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "picture/sum_span.h"

namespace organbake {

// What light depends on changes slowly over skin that runs on: of each eight pixels of a row it is
// worked out for three, and mixed between them; for every pixel where the skin breaks off or falls
// away steeply. Groups lie at multiples of eight of the picture's columns, so that a pixel's light
// does not depend on which part of the picture is drawn.
class SparseShading {
 public:
  static constexpr int kGroup = 8;

  // depth_mm: of the span's skin, +inf where none is to be lit; its first column is a multiple
  // of kGroup. texel_mm: of the cameras, on the surface.
  SparseShading(const float* depth_mm, int count, float texel_mm);

  // The pixels that are asked for, by their place in the span, ascending.
  int knot_count() const { return post_count_; }
  int knot(int k) const { return knots_[k]; }

  // Whether group g runs on: it has three knots, its first, middle and last pixel.
  bool smooth(int g) const { return smooth_[g]; }
  int count() const { return count_; }  // pixels

 private:
  int count_;
  std::array<bool, kSpan / kGroup> smooth_{};
  int post_count_ = 0;
  std::array<std::int32_t, kSpan> knots_;
};

// What is known of some of a span's knots, three numbers each and an unused one; row `count` holds
// what stands where nothing is known.
struct ShadedPosts {
  alignas(64) float rows[kSpan + 1][4];
};

// Spreads such tables over all pixels of their span.
class ShadingInterpolation {
 public:
  // at[k]: the pixel that row k is known of, one of the span's knots.
  ShadingInterpolation(const SparseShading& span, const std::int32_t* at, int count);

  // Into planes, whole vectors of the span. Equal numbers stay what they are.
  void operator()(const ShadedPosts& table, const std::array<float*, 3>& planes) const;

 private:
  const SparseShading& span_;
  std::array<std::int16_t, kSpan> row_;
};

}  // namespace organbake
