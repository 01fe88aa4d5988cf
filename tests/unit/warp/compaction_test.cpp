// SPDX-License-Identifier: GPL-3.0-or-later
#include "drawing/compaction.h"

#include <gtest/gtest.h>

#include <numeric>
#include <vector>

namespace organbake {
namespace {

TEST(Compaction, MovesTheChosenLanesToTheFrontInOrder) {
  std::array<std::uint32_t, 8> low, high;
  std::iota(low.begin(), low.end(), 100u);
  std::iota(high.begin(), high.end(), 0xFFFF0000u);
  for (unsigned mask = 0; mask < 256; ++mask) {
    std::vector<std::uint32_t> lanes;
    for (unsigned lane = 0; lane < 8; ++lane) {
      if (mask >> lane & 1) lanes.push_back(lane);
    }
    const Compaction packed(mask);
    ASSERT_EQ(packed.count(), int(lanes.size()));
    std::array<std::uint32_t, 8> alone;
    std::array<std::uint64_t, 8> together;
    packed(low.data(), alone.data());
    packed(low.data(), high.data(), together.data());
    for (std::size_t i = 0; i < lanes.size(); ++i) {
      ASSERT_EQ(alone[i], low[lanes[i]]) << mask;
      ASSERT_EQ(together[i], std::uint64_t{high[lanes[i]]} << 32 | low[lanes[i]]) << mask;
    }
  }
}

TEST(Compaction, LanesUnlikeAValueAreTold) {
  const std::array<std::uint32_t, 8> numbers = {7, 0xFF000000u, 0, 7, 0xFF000000u, 1, 2, 0};
  EXPECT_EQ(lanes_unlike(numbers.data(), 7), 0b11110110u);
  EXPECT_EQ(lanes_unlike(numbers.data(), 0xFF000000u), 0b11101101u);
  EXPECT_EQ(lanes_unlike(numbers.data(), 0), 0b01111011u);
}

}  // namespace
}  // namespace organbake
