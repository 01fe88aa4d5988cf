// SPDX-License-Identifier: GPL-3.0-or-later
#include "report/error_pictures.h"

#include <gtest/gtest.h>

#include <limits>

namespace organbake {
namespace {

TEST(HeatColor, GrowsFromBlackToWhiteAndStaysThere) {
  float before = -1;
  for (const double share : {0.0, 0.1, 0.3, 0.5, 0.8, 1.0}) {
    const float sum = heat_color(share).sum();
    EXPECT_GT(sum, before) << share;
    before = sum;
  }
  EXPECT_EQ(heat_color(0).sum(), 0);
  EXPECT_EQ(heat_color(7), heat_color(1));
}

TEST(HeatColor, TellsWhatIsNotFiniteFromAnyError) {
  const Eigen::Vector3f color = heat_color(std::numeric_limits<double>::quiet_NaN());
  EXPECT_GT(color[2], color[0]) << "no error is bluer than red";
}

}  // namespace
}  // namespace organbake
