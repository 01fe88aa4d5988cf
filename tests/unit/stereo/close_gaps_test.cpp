// SPDX-License-Identifier: GPL-3.0-or-later
#include "close_gaps.h"

#include <gtest/gtest.h>

namespace organbake {
namespace {

constexpr int kWidth = 120, kHeight = 60;

// A plane that is known but for two upright gaps, 6 and 20 px wide, and the right border.
Disparity plane_with_gaps() {
  Disparity plane{Plane(kWidth, kHeight), Mask(kWidth, kHeight, 1)};
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      plane.known.at(x, y) = !((x >= 20 && x < 26) || (x >= 50 && x < 70) || x >= 110);
      plane.px.at(x, y) = plane.known.at(x, y) ? 30 + 0.1F * x : 0;
    }
  return plane;
}

double share_of_columns(const Mask& mask, int from, int to) {
  double sum = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = from; x < to; ++x) sum += mask.at(x, y);
  return sum / ((to - from) * kHeight);
}

TEST(CloseGaps, ThoseThatAreNarrowerThanTheWidth) {
  const Mask all(kWidth, kHeight, 1);
  double before = -1;
  for (const auto& [width_px, narrow, wide] :
       {std::tuple{0.0, 0.0, 0.0}, {4.0, 0.0, 0.0}, {8.0, 1.0, 0.0}, {24.0, 1.0, 1.0}}) {
    Disparity disparity = plane_with_gaps();
    const Mask filled = close_gaps(all, width_px, disparity);
    EXPECT_NEAR(share_of_columns(filled, 20, 26), narrow, 0.3 * narrow) << width_px;
    EXPECT_NEAR(share_of_columns(filled, 50, 70), wide, 0.5 * wide) << width_px;
    EXPECT_EQ(share_of_columns(filled, 110, kWidth), 0) << "no gap: nothing is known beyond";
    const double in_all = share_of_columns(filled, 0, kWidth);
    EXPECT_GE(in_all, before);
    before = in_all;
    for (int x = 0; x < kWidth; ++x) {
      if (!filled.at(x, 30)) continue;
      EXPECT_NEAR(disparity.px.at(x, 30), 30 + 0.1F * static_cast<float>(x), 0.05);
    }
  }
}

TEST(CloseGaps, NotBetweenTwoDepthsNorWhereNoTissueIs) {
  Disparity step = plane_with_gaps();
  for (int y = 0; y < kHeight; ++y)
    for (int x = 23; x < kWidth; ++x) step.px.at(x, y) += 15;
  EXPECT_LT(share_of_columns(close_gaps(Mask(kWidth, kHeight, 1), 8, step), 20, 26), 0.1);
  Disparity plane = plane_with_gaps();
  EXPECT_EQ(share_of_columns(close_gaps(Mask(kWidth, kHeight), 8, plane), 0, kWidth), 0);
}

}  // namespace
}  // namespace organbake
