// SPDX-License-Identifier: Apache-2.0
#include "organbake/core/scalar_type.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <utility>

namespace organbake {
namespace {

constexpr std::array kAll = {ScalarType::int8,   ScalarType::uint8,  ScalarType::int16,
                             ScalarType::uint16, ScalarType::int32,  ScalarType::uint32,
                             ScalarType::int64,  ScalarType::uint64, ScalarType::float32,
                             ScalarType::float64};

// Least and largest value tell width, signedness and kind of a C++ type.
TEST(ScalarType, IsDispatchedToTheTypeOfItsName) {
  const std::array<std::pair<double, double>, 8> limits = {{{-128, 127},
                                                            {0, 255},
                                                            {-32768, 32767},
                                                            {0, 65535},
                                                            {-2147483648.0, 2147483647.0},
                                                            {0, 4294967295.0},
                                                            {-0x1p63, 0x1p63},  // rounded
                                                            {0, 0x1p64}}};
  for (std::size_t i = 0; i < limits.size(); ++i) {
    with_scalar_type(kAll[i], [&](auto zero) {
      using Number = decltype(zero);
      EXPECT_EQ(static_cast<double>(std::numeric_limits<Number>::lowest()), limits[i].first);
      EXPECT_EQ(static_cast<double>(std::numeric_limits<Number>::max()), limits[i].second);
    });
    EXPECT_FALSE(is_floating_point(kAll[i]));
    EXPECT_EQ(bytes_of(kAll[i]), std::size_t{1} << i / 2);
  }
  EXPECT_TRUE(is_floating_point(ScalarType::float32));
  EXPECT_TRUE(is_floating_point(ScalarType::float64));
  EXPECT_EQ(bytes_of(ScalarType::float32), 4u);
  EXPECT_EQ(bytes_of(ScalarType::float64), 8u);
}

TEST(ScalarType, SwapsTheBytesOfEachNumber) {
  for (const ScalarType type : kAll) {
    const std::size_t width = bytes_of(type);
    std::array<std::byte, 16> bytes, expected;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      bytes[i] = static_cast<std::byte>(i);
      expected[i] = static_cast<std::byte>(i / width * width + (width - 1 - i % width));
    }
    swap_bytes(bytes.data(), bytes.size() / width, type);
    EXPECT_EQ(bytes, expected);
  }
}

}  // namespace
}  // namespace organbake
