// SPDX-License-Identifier: Apache-2.0
#include "light/sparse_shading.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <vector>

namespace organbake {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kTexel_mm = 0.25f;  // steps of 1 mm are smooth, of 2 mm are not
// A plane over a span of this depth: number_of tells what it is at the pixels that are asked
// for, and −1 stands elsewhere.
template <class NumberOf>
std::vector<float> mixed(const std::vector<float>& depth, NumberOf&& number_of,
                         int* asked = nullptr) {
  const SparseShading span(depth.data(), static_cast<int>(depth.size()), kTexel_mm);
  const int knots = span.knot_count();
  std::vector<std::int32_t> at;
  ShadedPosts table;
  for (int k = 0; k < knots; ++k) {
    at.push_back(span.knot(k));
    table.rows[k][1] = number_of(at.back());
  }
  table.rows[knots][1] = -1;
  if (asked) *asked = knots;
  alignas(64) std::array<std::array<float, kSpan>, 3> planes;
  ShadingInterpolation(span, at.data(), knots)(
      table, {planes[0].data(), planes[1].data(), planes[2].data()});
  return {planes[1].begin(), planes[1].begin() + static_cast<std::ptrdiff_t>(depth.size())};
}

TEST(SparseShading, WhatRisesEvenlyIsMixedExactlyFromThreeOfEight) {
  int asked = 0;
  const auto number = [](int i) { return 0.5f + 0.25f * static_cast<float>(i); };
  const auto plane = mixed(std::vector<float>(kSpan, 300), number, &asked);
  EXPECT_EQ(asked, kSpan * 3 / SparseShading::kGroup);
  for (int i = 0; i < kSpan; ++i) EXPECT_NEAR(plane[i], number(i), 1e-5) << i;
}

TEST(SparseShading, EqualNumbersAreNotRounded) {
  for (const float value : mixed(std::vector<float>(kSpan, 300), [](int) { return 1 / 3.0f; }))
    EXPECT_EQ(value, 1 / 3.0f);
}

// Where the skin breaks off or falls away, and in a group that the span's end cuts, every pixel
// is asked for, however its light jumps.
TEST(SparseShading, BrokenSkinIsAskedForByThePixel) {
  std::vector<float> depth(38, 300);
  depth[3] = 302;         // a step in the first group
  depth[17] = kInfinity;  // a hole in the third
  const auto number = [](int i) { return static_cast<float>(i % 3); };
  const auto plane = mixed(depth, number);
  for (const int i : {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 15, 16, 18, 19, 23, 32, 33, 37})
    EXPECT_EQ(plane[i], number(i)) << i;
  EXPECT_EQ(plane[17], -1) << "not skin";
  EXPECT_EQ(plane[10], 0.5f * (number(8) + number(12)));
}

TEST(SparseShading, NoSkinAsksForNoLight) {
  EXPECT_EQ(SparseShading(std::vector<float>(40, kInfinity).data(), 40, kTexel_mm).knot_count(), 0);
  EXPECT_EQ(SparseShading(nullptr, 0, kTexel_mm).knot_count(), 0);
}

}  // namespace
}  // namespace organbake
