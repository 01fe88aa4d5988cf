// SPDX-License-Identifier: Apache-2.0
#include "drawing/dominant_samples.h"

#include <algorithm>
#include <limits>

#include "picture/vector_loops.h"

namespace organbake {
namespace {

ORGANBAKE_MULTIVERSION void take_nearer(std::int32_t l, const LayerSpan& __restrict row, int count,
                                        NearestSamples& __restrict nearest) {
  ORGANBAKE_LANES(4)
  for (unsigned i = 0; i < whole_vectors(count); ++i) {
    nearest.layer[i] = row.depth[i] < nearest.depth[i] ? l : nearest.layer[i];
    nearest.depth[i] = row.depth[i] < nearest.depth[i] ? row.depth[i] : nearest.depth[i];
  }
}

ORGANBAKE_MULTIVERSION void prefer(std::int32_t l, const LayerSpan& __restrict row,
                                   const SumSpan& __restrict sum, float tolerance_mm, int count,
                                   DominantSamples& __restrict leading) {
  ORGANBAKE_LANES(4)
  for (unsigned i = 0; i < whole_vectors(count); ++i)
    leading.layer[i] = row.depth[i] <= sum.nearest[i] + tolerance_mm ? l : leading.layer[i];
}

}  // namespace

NearestSamples::NearestSamples(const LayerSpans& rows, int layers, int count) {
  std::fill_n(layer, whole_vectors(count), 0);
  std::fill_n(depth, whole_vectors(count), std::numeric_limits<float>::infinity());
  for (int l = 0; l < layers; ++l) take_nearer(l, rows[l], count, *this);
}

DominantSamples::DominantSamples(const LayerShares& shares, const LayerSpans& rows,
                                 const SumSpan& sum, float tolerance_mm, int count) {
  std::copy_n(NearestSamples(rows, shares.count, count).layer, whole_vectors(count), layer);
  std::array<int, 3> by_share = {0, 1, 2};
  const auto used = by_share.begin() + shares.count;
  // Of equal shares the first layer comes last, and stands.
  const auto earlier = [&](int a, int b) {
    return shares.of[a] != shares.of[b] ? shares.of[a] < shares.of[b] : a > b;
  };
  // At most three: in std::sort g++ 12 sees, on some processors, an index that is never formed.
  for (auto first = by_share.begin(); first != used; ++first)
    std::iter_swap(first, std::min_element(first, used, earlier));
  std::for_each(by_share.begin(), used,
                [&](int l) { prefer(l, rows[l], sum, tolerance_mm, count, *this); });
}

}  // namespace organbake
